//! Masks of the photos: all but black borders and the areas that the user's masks cover.

use std::{
    collections::BTreeMap,
    io,
    path::{Path, PathBuf},
};

use super::{
    PrepareError,
    borders::{Borders, Frame},
    photos::{Photos, png},
};
use crate::{
    capture::{
        CaptureError, Normalize, SensorOrientation, in_order,
        names::{NamedFiles, visit_files},
        plain_photo, read_mask,
    },
    disk,
    store::files,
};

/// Borders are looked for in so many photos, evenly spread.
const LOOKED_AT: usize = 40;

/// Fewer photos may be dark at their border by chance.
const FEWEST: usize = 5;

/// Sources of masks.
#[derive(Default)]
pub(super) struct Sources {
    /// Black borders.
    pub borders: Option<Frame>,
    /// A mask for all photos.
    pub one: Option<PathBuf>,
    /// Masks by the names of the photos.
    pub each: Option<NamedFiles>,
}

/// Counts of the masks that were written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct MaskFiles {
    /// Photos with a mask.
    pub masked: usize,
    /// Pictures in the folder of masks that belong to no photo.
    pub strays: usize,
}

/// The black borders of photos that have one size; others have none in common.
///
/// # Errors
/// If one cannot be read.
pub(super) fn borders(
    photos: &Photos,
    folder: &Path,
    told: &mut dyn FnMut(usize, usize),
) -> Result<Option<Frame>, PrepareError> {
    let mut sizes: Vec<_> = photos.headers.values().map(|header| header.size).collect();
    sizes.dedup();
    if sizes.len() != 1 || photos.headers.len() < FEWEST {
        return Ok(None);
    }
    let count = photos.headers.len();
    let step = count.div_ceil(LOOKED_AT);
    let paths: Vec<PathBuf> = photos
        .headers
        .keys()
        .step_by(step)
        .map(|name| folder.join(name))
        .collect();
    let mut found = Borders::default();
    let mut looked_at = 0;
    in_order(
        &paths,
        |path| plain_photo(path, Normalize::Off),
        |_, photo| {
            found.look(&photo?);
            looked_at += 1;
            told(looked_at, paths.len());
            Ok::<_, CaptureError>(())
        },
    )?;
    Ok(found.found())
}

/// Masks in a folder by the names of photos.
///
/// # Errors
/// If it cannot be read or has a mask for none of them.
pub(super) fn named(folder: &Path, photos: &Photos) -> Result<NamedFiles, PrepareError> {
    let mut named = NamedFiles::default();
    visit_files(folder, &mut |name, path| {
        if name.to_ascii_lowercase().ends_with(".png") {
            named.insert(&name, path);
        }
    })
    .map_err(|(path, error)| files::at(&path)(error))?;
    named.know(photos.headers.keys().map(String::as_str));
    for name in photos.headers.keys() {
        if named.of(name).map_err(CaptureError::from)?.is_some() {
            return Ok(named);
        }
    }
    let example = photos
        .headers
        .keys()
        .next()
        .map(|name| format!("{name}.png"));
    Err(PrepareError::from(CaptureError::NoMasks {
        dir: folder.into(),
        example: example.unwrap_or_default().into(),
    }))
}

impl Sources {
    /// Writes a mask of each photo that has one into a folder that is there, as `NAME.png`.
    ///
    /// # Errors
    /// If a mask cannot be read or leaves nothing of a photo, and the system's.
    pub fn write(
        &self,
        photos: &Photos,
        images: &Path,
        to: &Path,
        told: &mut dyn FnMut(usize, usize),
    ) -> Result<MaskFiles, PrepareError> {
        let mut made = MaskFiles {
            strays: self.each.as_ref().map_or(0, |named| named.strays().len()),
            ..MaskFiles::default()
        };
        // Photos without a mask of their own share one file for each size.
        let mut shared: BTreeMap<[u32; 2], PathBuf> = BTreeMap::new();
        for (done, (name, header)) in photos.headers.iter().enumerate() {
            told(done, photos.headers.len());
            let own = self.each.as_ref().map(|named| named.of(name)).transpose();
            let own = own.map_err(CaptureError::from)?.flatten();
            let path = to.join(format!("{name}.png"));
            if own.is_none() && self.borders.is_none() && self.one.is_none() {
                continue;
            }
            disk::make_folder(disk::folder_of(&path)).map_err(files::at(&path))?;
            made.masked += 1;
            if let (None, Some(same)) = (own, shared.get(&header.size)) {
                disk::link(same, &path).map_err(files::at(&path))?;
                continue;
            }
            let photo = images.join(name);
            let counts = self.counts(own, &photo, header.size)?;
            let bytes = png(&counts, header.size).map_err(files::at(&path))?;
            files::write(&path, &bytes)?;
            if own.is_none() {
                shared.insert(header.size, path);
            }
        }
        Ok(made)
    }

    /// Mask of a photo, `[height, width]`, 0 to 255.
    fn counts(
        &self,
        own: Option<&Path>,
        photo: &Path,
        size: [u32; 2],
    ) -> Result<Vec<u8>, PrepareError> {
        let mut counts = match self.borders {
            Some(borders) => borders.mask(size),
            None => vec![u8::MAX; size.iter().map(|&side| side as usize).product()],
        };
        for mask in own.into_iter().chain(self.one.as_deref()) {
            let mask = read_mask(mask, photo, size, SensorOrientation::default())?;
            counts
                .iter_mut()
                .zip(mask)
                .for_each(|(count, mask)| *count = mask.min(*count));
        }
        if counts.iter().all(|&count| count == 0) {
            let reason = "its mask leaves no pixel; make it white where the photo counts";
            return Err(PrepareError::at(photo, reason));
        }
        Ok(counts)
    }
}

/// White masks for the photos that have none, beside the others: COLMAP may want one for each.
///
/// # Errors
/// The system's.
pub(super) fn complete(photos: &Photos, masks: &Path, to: &Path) -> Result<(), PrepareError> {
    for (name, header) in &photos.headers {
        let (from, path) = (
            masks.join(format!("{name}.png")),
            to.join(format!("{name}.png")),
        );
        let made = || -> io::Result<()> {
            disk::make_folder(disk::folder_of(&path))?;
            if from.is_file() {
                return disk::link(&from, &path);
            }
            let white = vec![u8::MAX; header.size.iter().map(|&side| side as usize).product()];
            let bytes = png(&white, header.size)?;
            let mut file = disk::create(&path)?;
            io::Write::write_all(&mut file, &bytes)?;
            file.persist(&path)
        };
        made().map_err(files::at(&path))?;
    }
    Ok(())
}
