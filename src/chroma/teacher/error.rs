//! Errors of teachers.

use std::io;
use std::path::{Path, PathBuf};

use crate::capture::AmbiguousNames;

/// A teacher cannot be opened or cannot color a photo.
#[derive(Debug, thiserror::Error)]
pub enum TeacherError {
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The path leads to something else.
    #[error("{}: a teacher is an .onnx file or a folder of colored images", path.display())]
    NoTeacher {
        /// Path that was given.
        path: PathBuf,
    },
    /// The shared library of ONNX Runtime is nowhere.
    #[error(
        "ONNX Runtime was not found: put its shared library, 1.17 or newer (lib/ in a release from \
         https://github.com/microsoft/onnxruntime/releases, or onnxruntime/capi/ in the Python \
         package) {}", where_to(cache.as_deref())
    )]
    NoRuntime {
        /// The project's folder for it; none where the system names no place for caches.
        cache: Option<PathBuf>,
    },
    /// The system names no place for caches.
    #[error("there is no folder to keep networks in: let HOME or XDG_CACHE_HOME name one")]
    NoCacheFolder,
    /// The shared library of ONNX Runtime does not load.
    #[error("{}: not a usable ONNX Runtime library: {reason}", path.display())]
    BadRuntime {
        /// Library that was found.
        path: PathBuf,
        /// The loader's reason.
        reason: String,
    },
    /// ONNX Runtime does not take the model.
    #[error("{}: not a usable ONNX model: {reason}", path.display())]
    BadModel {
        /// The `.onnx` file.
        path: PathBuf,
        /// The runtime's reason.
        reason: String,
    },
    /// The library cannot use the device that is asked for.
    #[error("{}: the ONNX Runtime at hand was built without {device}", path.display())]
    NoDevice {
        /// The `.onnx` file.
        path: PathBuf,
        /// The device's name.
        device: &'static str,
    },
    /// A file of weights that the model names is not there.
    #[error(
        "{}: its weights lie in {weights}, which is not there; both files belong into one folder",
        path.display()
    )]
    NoWeights {
        /// The `.onnx` file.
        path: PathBuf,
        /// The name that it has for the other.
        weights: String,
    },
    /// The model is no colorization network that is known here.
    #[error(
        "{}: no known colorization network: it has {found}; accepted: {accepted}; a .toml beside \
         it can describe another (docs/guides/teachers.md)", path.display()
    )]
    NoProfile {
        /// The `.onnx` file.
        path: PathBuf,
        /// Its inputs and outputs.
        found: String,
        /// Those of the known networks.
        accepted: String,
    },
    /// More than one kind of network has such inputs and outputs.
    #[error(
        "{}: several kinds of networks have its inputs and outputs, and only you can know which \
         it is: {profiles}", path.display()
    )]
    SeveralProfiles {
        /// The `.onnx` file.
        path: PathBuf,
        /// Names of the profiles.
        profiles: String,
    },
    /// Answers are no colors if numbers mean what they are taken for.
    #[error(
        "{}: its answers for photo {photo}, {:?} to {:?}, are no colors of {kind}; only you can \
         know what its numbers mean", path.display(), range[0], range[1]
    )]
    Senseless {
        /// The `.onnx` file.
        path: PathBuf,
        /// The photo's name.
        photo: String,
        /// Name of the profile.
        kind: String,
        /// Least and largest of its numbers.
        range: [f32; 2],
    },
    /// No built-in profile has this name.
    #[error("{name}: no such profile; there are {known}, or name a .toml manifest")]
    UnknownProfile {
        /// Name that was given.
        name: String,
        /// Names of the built-in profiles.
        known: String,
    },
    /// Neither a path nor a network that is known by name.
    #[error("{name}: no such file or folder, and no network of that name; there are {known}")]
    UnknownTeacher {
        /// Name that was given.
        name: String,
        /// Names of the networks.
        known: String,
    },
    /// A network that is known by name is not on this machine.
    #[error("{name}: not on this machine yet")]
    NotFetched {
        /// Name that the user gave.
        name: String,
    },
    /// A network that is kept under its name has other bytes.
    #[error("{}: is not {name}, whose SHA-256 is another; delete it, and fetch it again", path.display())]
    OtherBytes {
        /// The `.onnx` file.
        path: PathBuf,
        /// Name that the user gave.
        name: String,
    },
    /// A table of networks does not describe them.
    #[error("{}: {reason}; assets/teachers.toml shows how it is written", path.display())]
    BadCatalog {
        /// The `.toml` file.
        path: PathBuf,
        /// The network, the field and what is wrong with it.
        reason: String,
    },
    /// A manifest does not describe a network.
    #[error("{}: {reason}; docs/guides/teachers.md lists the fields of a manifest", path.display())]
    BadManifest {
        /// The `.toml` file.
        path: PathBuf,
        /// The field and what is wrong with it.
        reason: String,
    },
    /// The model does not take the size that was asked for.
    #[error("{}: size {size}: {reason}", path.display())]
    BadSize {
        /// The `.onnx` file.
        path: PathBuf,
        /// Size that was given, in pixels.
        size: u32,
        /// Reason, and sizes that are possible.
        reason: String,
    },
    /// A class was asked for, and the model takes none.
    #[error("{}: takes no class", path.display())]
    NoClass {
        /// The `.onnx` file.
        path: PathBuf,
    },
    /// A hint says something about every pixel.
    #[error(
        "{}: has no transparency and is not its photo with strokes on it, so it would paint the \
         whole photo; save the strokes alone on a transparent layer, as PNG or TIFF", path.display()
    )]
    NoTransparency {
        /// Image at fault.
        path: PathBuf,
    },
    /// The network failed on a photo.
    #[error("{}: failed on photo {photo}: {reason}", path.display())]
    Network {
        /// The `.onnx` file.
        path: PathBuf,
        /// The photo's name.
        photo: String,
        /// Reason of the failure.
        reason: String,
    },
    /// The photo's pixels do not fill its size.
    #[error("photo {photo}: {pixels} pixels do not make an image of {width} x {height}")]
    BadPhoto {
        /// The photo's name.
        photo: String,
        /// The photo's width.
        width: u32,
        /// The photo's height.
        height: u32,
        /// Number of pixels.
        pixels: usize,
    },
    /// The folder holds no image.
    #[error("{}: holds no .png, .jpg or .tif image", path.display())]
    EmptyFolder {
        /// Folder at fault.
        path: PathBuf,
    },
    /// Nobody knows which image of the folder belongs to which photo.
    #[error(transparent)]
    AmbiguousNames(AmbiguousNames),
    /// An image of the folder does not decode.
    #[error("{}: not a readable image: {reason}", path.display())]
    BadImage {
        /// Image at fault.
        path: PathBuf,
        /// The decoder's reason.
        reason: String,
    },
    /// Images of the folder have the names of other photos than those that they show.
    #[error(
        "{}: {count} of {images} images show other photos than those they are named after ({shown}): \
         rename them", path.display()
    )]
    OtherPhotos {
        /// The folder.
        path: PathBuf,
        /// Number of images that show other photos.
        count: usize,
        /// Images that were asked for.
        images: usize,
        /// The first of them, and what they show.
        shown: String,
    },
    /// An image of the folder shows another cut of the photo.
    #[error(
        "{}: {} x {} has another aspect than photo {photo}, which is used at {} x {}; {}",
        path.display(), size[0], size[1], photo_size[0], photo_size[1],
        match turned(*size, *photo_size) {
            true => "it seems to be turned by 90 degrees: turn it back",
            false => "crop or pad it to the photo's aspect",
        }
    )]
    Aspect {
        /// Image at fault.
        path: PathBuf,
        /// Its width and height.
        size: [u32; 2],
        /// The photo's name.
        photo: String,
        /// The photo's width and height where it is used.
        photo_size: [u32; 2],
    },
}

/// Returns true if an image has the other's aspect once it is turned, to within 2 %.
fn turned([width, height]: [u32; 2], [of_width, of_height]: [u32; 2]) -> bool {
    let aspect = f64::from(width) * f64::from(of_width);
    (aspect / (f64::from(height) * f64::from(of_height)) - 1.0).abs() <= 0.02
}

impl TeacherError {
    /// Names the file of an I/O error.
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, source }
    }
}

/// Advice on the folder for ONNX Runtime's library.
fn where_to(cache: Option<&Path>) -> String {
    match cache {
        Some(cache) => format!("into {}, or let ORT_DYLIB_PATH name it", cache.display()),
        None => "anywhere, and let ORT_DYLIB_PATH name it".to_owned(),
    }
}

/// The first line of a message, for errors that have one line.
pub(super) fn first_line(message: impl ToString) -> String {
    let message = message.to_string();
    message
        .lines()
        .next()
        .unwrap_or_default()
        .trim()
        .to_string()
}
