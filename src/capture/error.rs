//! Errors of loading a capture.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Position of an error in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// Bytes from the start of a binary file.
    Byte(u64),
    /// Line of a text file, counted from 1.
    Line(u64),
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Byte(offset) => write!(f, "byte {offset}"),
            Self::Line(number) => write!(f, "line {number}"),
        }
    }
}

/// A capture or one of its photos cannot be loaded.
#[derive(Debug, Error)]
pub enum CaptureError {
    /// The given path is no folder.
    #[error(
        "{dir}: no such folder; give the COLMAP folder that holds images/ and sparse/, or one with transforms.json"
    )]
    NoFolder {
        /// The path that was given.
        dir: PathBuf,
    },
    /// The folder holds no `images/`.
    #[error(
        "{dir}: holds no images/ folder and no transforms.json; put the photos that COLMAP saw there"
    )]
    NoImagesFolder {
        /// The folder that was given.
        dir: PathBuf,
    },
    /// The folder holds no COLMAP model.
    #[error(
        "{dir}: holds no COLMAP model; put cameras, images and points3D (.bin or .txt) into its sparse/0/, or nerfstudio's transforms.json beside images/"
    )]
    NoModel {
        /// The folder that was given.
        dir: PathBuf,
    },
    /// The folder holds another program's files.
    #[error(
        "{path}: is of {program}, whose files are not read; export COLMAP's model there ({export}), and the photos to images/"
    )]
    OtherProgram {
        /// A file of the program.
        path: PathBuf,
        /// Its name.
        program: &'static str,
        /// Menu of the export.
        export: &'static str,
    },
    /// A `transforms.json` or its point cloud is invalid.
    #[error("{path}: {reason}")]
    Transforms {
        /// File at fault.
        path: PathBuf,
        /// The error, with the field.
        reason: String,
    },
    /// Some of a model's three files are there and some are not.
    #[error(
        "{dir}: holds {present} but no {missing}; a COLMAP model needs cameras, images and points3D, all .bin or all .txt"
    )]
    IncompleteModel {
        /// The model's folder.
        dir: PathBuf,
        /// A file that is there.
        present: String,
        /// A file that is not.
        missing: String,
    },
    /// Only one of the two files `rigs` and `frames` is there.
    #[error(
        "{path}: there is no {missing} beside it; COLMAP writes both: export the model again, or remove this file if the poses of images are right"
    )]
    IncompleteRigs {
        /// The file that is there.
        path: PathBuf,
        /// The one that is not.
        missing: String,
    },
    /// The operating system could not write what photos are to be without.
    #[error("{path}: cannot be written to: {source}")]
    Write {
        /// Folder at fault.
        path: PathBuf,
        /// The operating system's error.
        source: io::Error,
    },
    /// The operating system could not read a file.
    #[error("{path}: cannot be read: {source}")]
    Read {
        /// File at fault.
        path: PathBuf,
        /// The operating system's error.
        source: io::Error,
    },
    /// A model file contradicts COLMAP's format.
    #[error("{path}: {record}, {position}: {reason}; export the model from COLMAP again")]
    Malformed {
        /// File at fault.
        path: PathBuf,
        /// The record, such as `image 3 of 12`.
        record: String,
        /// Position in the file.
        position: Position,
        /// The contradiction.
        reason: String,
    },
    /// An image's name leads to no photo.
    #[error(
        "{path}: {record}, {position}: {reason}; rename the photos and run COLMAP again, or edit the names in images.txt (COLMAP's model_converter writes one)"
    )]
    ImageName {
        /// The images file.
        path: PathBuf,
        /// The record, such as `image 3 of 12`.
        record: String,
        /// Position in the file.
        position: Position,
        /// The error in the name.
        reason: String,
    },
    /// A camera's model is not one of COLMAP's.
    #[error(
        "{path}: camera {camera_id} has the model {model}, which is none of COLMAP 4.2's; run its image_undistorter and give the output folder"
    )]
    CameraModel {
        /// The cameras file.
        path: PathBuf,
        /// COLMAP's id of the camera.
        camera_id: u32,
        /// COLMAP's name of the model, or its number where it is unknown.
        model: String,
    },
    /// A camera's calibration cannot be a lens's.
    #[error(
        "{path}: camera {camera_id}, {model}: {reason}; calibrate it again, or run COLMAP's image_undistorter and give the output folder"
    )]
    Lens {
        /// The cameras file.
        path: PathBuf,
        /// COLMAP's id of the camera.
        camera_id: u32,
        /// COLMAP's name of the model.
        model: &'static str,
        /// The error in the calibration.
        reason: String,
    },
    /// The model holds no images.
    #[error("{path}: holds no images; COLMAP registered none, so its mapper has to run again")]
    NoImages {
        /// The images file.
        path: PathBuf,
    },
    /// The model holds no usable points.
    #[error("{path}: holds no usable points; run COLMAP's point_triangulator or mapper")]
    NoPoints {
        /// The points file.
        path: PathBuf,
    },
    /// Two images have one name.
    #[error("{path}: two images are named {name}; remove one with COLMAP's image_deleter")]
    DuplicateName {
        /// The images file.
        path: PathBuf,
        /// The name they share.
        name: String,
    },
    /// No image has a usable pose.
    #[error("{path}: none of its {count} images has a usable pose; the first, {name}: {reason}")]
    AllRejected {
        /// The images file.
        path: PathBuf,
        /// Number of rejected images.
        count: usize,
        /// The first of them by name.
        name: String,
        /// Reason for which that one was rejected.
        reason: String,
    },
    /// Photos that the model names are not there.
    #[error(
        "{first}: no such photo, and {missing} of {total} are missing; copy them there under these names"
    )]
    MissingPhotos {
        /// The first missing photo by name.
        first: PathBuf,
        /// Number of missing photos.
        missing: usize,
        /// Number of photos that the model names.
        total: usize,
    },
    /// A photo or a mask cannot be decoded.
    #[error("{path}: {reason}")]
    Photo {
        /// File at fault.
        path: PathBuf,
        /// The error and its remedy.
        reason: String,
    },
    /// A photo has another shape than its camera.
    #[error(
        "{path}: is {}×{} pixels but its camera is {}×{}; use the photos that COLMAP saw, not turned or cropped",
        .photo[0], .photo[1], .camera[0], .camera[1]
    )]
    PhotoSize {
        /// Photo at fault.
        path: PathBuf,
        /// Its width and height.
        photo: [u32; 2],
        /// The camera's width and height.
        camera: [u32; 2],
    },
    /// One range was to serve photos whose values mean different things.
    #[error(
        "{path}: has {depth} a channel but {other} has {other_depth}: one range cannot normalize both; convert one of them"
    )]
    MixedDepths {
        /// A photo.
        path: PathBuf,
        /// Depth of its values, such as `8 bits`.
        depth: String,
        /// A photo of another kind.
        other: PathBuf,
        /// Depth of that photo's values.
        other_depth: String,
    },
    /// A range holds none of the values that a photo can have.
    #[error(
        "{path}: has {depth} a channel, values from 0 to {white}: none lies within the range {},{}",
        .range[0], .range[1]
    )]
    RangeBeyond {
        /// A photo.
        path: PathBuf,
        /// Depth of its values, such as `8 bits`.
        depth: String,
        /// The greatest of them.
        white: f64,
        /// Lowest and highest value of the range.
        range: [f64; 2],
    },
    /// The folder of masks is not there.
    #[error("{dir}: no such folder of masks")]
    NoMaskFolder {
        /// Folder at fault.
        dir: PathBuf,
    },
    /// No mask has the name of a photo.
    #[error("{dir}: holds no mask for any photo, such as {example}; name masks like COLMAP does")]
    NoMasks {
        /// The folder of masks.
        dir: PathBuf,
        /// Expected path of the first photo's mask.
        example: PathBuf,
    },
    /// A mask has another shape than its photo.
    #[error(
        "{path}: the mask is {}×{} pixels but {photo} is {}×{}; make it of the photo's size or aspect",
        .mask[0], .mask[1], .size[0], .size[1]
    )]
    MaskSize {
        /// Mask at fault.
        path: PathBuf,
        /// Its width and height.
        mask: [u32; 2],
        /// Photo at fault.
        photo: PathBuf,
        /// The photo's width and height.
        size: [u32; 2],
    },
    /// The description of a capture's film is invalid.
    #[error("{path}: {reason}; prepare the film again")]
    Film {
        /// File at fault.
        path: PathBuf,
        /// The error in the description.
        reason: String,
    },
    /// Nobody knows which mask belongs to which photo.
    #[error(transparent)]
    Mask(#[from] AmbiguousNames),
    /// Nothing of a photo is left.
    #[error("{path}: {reason}; mend it, or remove the photo with COLMAP's image_deleter")]
    NothingCounts {
        /// Photo at fault.
        path: PathBuf,
        /// Reason for which nothing of it is left.
        reason: String,
    },
}

impl CaptureError {
    /// Names the file that could not be read.
    pub(super) fn read(path: &Path) -> impl Fn(io::Error) -> Self {
        |source| Self::Read {
            path: path.into(),
            source,
        }
    }
}

/// A file or a photo cannot be matched by name.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum AmbiguousNames {
    /// Two files would belong to one photo.
    #[error("{} and {}: both would belong to one photo; keep one of them", .0[0].display(), .0[1].display())]
    Files([PathBuf; 2]),
    /// A file would belong to two photos, of these names.
    #[error("{}: may belong to photo {} or to {}; put the photo's full name before its extension, such as {}.png", .0.display(), .1[0], .1[1], .1[0])]
    Photos(PathBuf, [String; 2]),
}
