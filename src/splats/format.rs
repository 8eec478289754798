//! The formats of splat files, told by a file's name.

use std::path::{Path, PathBuf};

/// A format of splat files; docs/formats.md compares them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// The layout of the reference implementation, 32-bit floats.
    Ply,
    /// PlayCanvas' compressed `.ply`.
    CompressedPly,
    /// 32 bytes a Gaussian.
    Splat,
    /// Niantic's.
    Spz,
    /// PlayCanvas' Spatially Ordered Gaussians, in one file.
    Sog,
    /// glTF with `KHR_gaussian_splatting`.
    Glb,
    /// OpenUSD as text.
    Usda,
}

impl Format {
    /// All of them; of two extensions that a name may end in, the longer is before the other.
    pub const ALL: [Self; 7] = [
        Self::CompressedPly,
        Self::Ply,
        Self::Splat,
        Self::Spz,
        Self::Sog,
        Self::Glb,
        Self::Usda,
    ];

    /// File name extension, with its dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ply => ".ply",
            Self::CompressedPly => ".compressed.ply",
            Self::Splat => ".splat",
            Self::Spz => ".spz",
            Self::Sog => ".sog",
            Self::Glb => ".glb",
            Self::Usda => ".usda",
        }
    }

    /// The format that a file's name tells, whatever the case of its letters.
    pub fn of(path: &Path) -> Option<Self> {
        let (format, _) = Self::split(path)?;
        Some(format)
    }

    /// The path of a splat file without its extension.
    pub fn stem(path: &Path) -> PathBuf {
        match Self::split(path) {
            Some((_, stem)) => path.with_file_name(stem),
            None => path.with_extension(""),
        }
    }

    /// Returns true if the format can be read, not only written.
    pub fn is_read(self) -> bool {
        !matches!(self, Self::Glb | Self::Usda)
    }

    /// Returns true if its files can mark scenes as antialiased.
    pub fn tells_antialiasing(self) -> bool {
        self != Self::Splat
    }

    /// Returns true if it stores view-dependent color: harmonics above degree 0.
    pub fn has_harmonics(self) -> bool {
        self != Self::Splat
    }

    /// Returns true if its files can store the offset subtracted from the coordinates.
    pub fn tells_offset(self) -> bool {
        !matches!(self, Self::Splat | Self::Spz)
    }

    /// The extensions of some, for a sentence.
    pub(super) fn list(which: impl Fn(Self) -> bool) -> String {
        let some = Self::ALL.into_iter().filter(|&format| which(format));
        some.map(Self::extension).collect::<Vec<_>>().join(", ")
    }

    fn split(path: &Path) -> Option<(Self, String)> {
        let name = path.file_name()?.to_string_lossy();
        Self::ALL.into_iter().find_map(|format| {
            let at = name.len().checked_sub(format.extension().len())?;
            let (stem, end) = name.split_at_checked(at)?;
            end.eq_ignore_ascii_case(format.extension())
                .then(|| (format, stem.to_owned()))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::is_splat_file;
    use super::*;

    #[test]
    fn names_tell_formats() {
        let of = |name: &str| Format::of(Path::new(name));
        assert_eq!(of("a/b.ply"), Some(Format::Ply));
        assert_eq!(of("b.Compressed.PLY"), Some(Format::CompressedPly));
        assert_eq!(of("compressed.ply"), Some(Format::Ply));
        assert_eq!(of("b.SPZ"), Some(Format::Spz));
        for unknown in ["b", "ply", "b.ply.gz", "b.obj", "a.ply/b", "ü.pl"] {
            assert_eq!(of(unknown), None, "{unknown}");
        }
        for format in Format::ALL {
            let name = format!("runs/scene{}", format.extension());
            assert_eq!(of(&name), Some(format));
            assert_eq!(Format::stem(Path::new(&name)), Path::new("runs/scene"));
        }
    }

    #[test]
    fn what_is_not_read_is_refused_with_a_remedy() {
        for name in ["scene.ksplat", "scene.GLB", "a.usda", "b.usdz"] {
            let message = is_splat_file(Path::new(name)).unwrap_err().to_string();
            assert!(message.starts_with(name), "{message}");
            assert!(message.contains("convert it to .ply"), "{message}");
        }
        for name in ["a.PLY", "a.spz", "a.splat", "a.sog", "a.compressed.ply"] {
            assert!(is_splat_file(Path::new(name)).unwrap(), "{name}");
        }
        assert!(!is_splat_file(Path::new("runs/a")).unwrap());
        let unknown = Format::to_write(Path::new("a.obj")).unwrap_err();
        assert!(
            unknown
                .to_string()
                .contains(".compressed.ply, .ply, .splat")
        );
    }
}
