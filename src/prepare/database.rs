//! COLMAP's database of features and verified matches.

use std::{collections::BTreeMap, path::Path};

use rusqlite::{Connection, OpenFlags};

use super::PrepareError;

/// `pair_id = first · PAIR + second`, of image ids (COLMAP's `kMaxNumImages`).
const PAIR: i64 = 2_147_483_647;

/// Features of photos, and which of them show the same.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Matches {
    pub photos: Vec<MatchedPhoto>,
    pub pairs: Vec<Pair>,
}

/// A photo that COLMAP knows.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MatchedPhoto {
    pub name: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Centers of features in pixels; (0.5, 0.5) is the center of the first pixel.
    pub features: Vec<[f32; 2]>,
}

/// Two photos with matches that agree with one geometry.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pair {
    /// Indices of the photos.
    pub photos: [usize; 2],
    /// Indices of the features that match.
    pub matches: Vec<[u32; 2]>,
}

impl Matches {
    /// Reads a database.
    ///
    /// # Errors
    /// [`PrepareError`] where it is no database of COLMAP's.
    pub fn read(path: &Path) -> Result<Self, PrepareError> {
        read(path)
            .map_err(|error| PrepareError::at(path, format!("is no database of COLMAP's: {error}")))
    }
}

fn read(path: &Path) -> rusqlite::Result<Matches> {
    // Immutable, or SQLite would lay its log beside the file.
    let escaped = path
        .to_string_lossy()
        .replace('%', "%25")
        .replace('?', "%3f")
        .replace('#', "%23");
    let database = Connection::open_with_flags(
        format!("file:{escaped}?immutable=1"),
        OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI,
    )?;
    let mut found = Matches::default();
    let mut indices = BTreeMap::new();
    let mut images = database.prepare(
        "SELECT images.image_id, images.name, cameras.width, cameras.height, keypoints.cols, \
         keypoints.data FROM images JOIN cameras USING (camera_id) \
         JOIN keypoints USING (image_id) ORDER BY images.name",
    )?;
    let mut rows = images.query([])?;
    while let Some(row) = rows.next()? {
        let columns = row.get::<_, u32>(4)? as usize;
        let data: Option<Vec<u8>> = row.get(5)?;
        let values = words(data.as_deref().unwrap_or_default()).map(f32::from_bits);
        let values: Vec<f32> = values.collect();
        indices.insert(row.get::<_, i64>(0)?, found.photos.len());
        found.photos.push(MatchedPhoto {
            name: row.get(1)?,
            size: [row.get(2)?, row.get(3)?],
            features: (values.chunks_exact(columns.max(2)))
                .map(|feature| [feature[0], feature[1]])
                .collect(),
        });
    }
    let mut verified =
        database.prepare("SELECT pair_id, data FROM two_view_geometries WHERE rows > 0")?;
    let mut rows = verified.query([])?;
    while let Some(row) = rows.next()? {
        let id: i64 = row.get(0)?;
        let of = |image: i64| indices.get(&image).copied();
        let (Some(first), Some(second)) = (of(id / PAIR), of(id % PAIR)) else {
            continue;
        };
        let data: Vec<u8> = row.get(1)?;
        let features = [first, second].map(|photo| found.photos[photo].features.len() as u32);
        let matches = words(&data).collect::<Vec<_>>();
        let matches = (matches.as_chunks::<2>().0.iter().copied())
            .filter(|[a, b]| *a < features[0] && *b < features[1]);
        found.pairs.push(Pair {
            photos: [first, second],
            matches: matches.collect(),
        });
    }
    found.pairs.sort_by_key(|pair| pair.photos);
    Ok(found)
}

/// Little-endian words of 32 bits.
fn words(bytes: &[u8]) -> impl Iterator<Item = u32> {
    bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|word| u32::from_le_bytes(*word))
}
