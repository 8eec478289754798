//! Networks that are known by name: where they lie, and what they are by their SHA-256.

use super::TeacherError;
use super::places::cache_folder;
use super::profile::{Profile, named};
use crate::{hash, input};
use serde::{Deserialize, Serialize};
use std::env;
use std::path::{Path, PathBuf};

/// Environment variable that names another table.
const VARIABLE: &str = "GS_CHROMA_TEACHERS";

/// The table that the program brings along.
const BUILT_IN: &str = include_str!("../../../assets/teachers.toml");

/// A table of networks and the folder in which they are kept.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Catalog {
    /// Hosts that networks may be fetched from; `.example.org` stands for all below it.
    pub hosts: Vec<String>,
    /// The networks, in the order in which they are shown.
    pub teachers: Vec<KnownTeacher>,
    /// Folder of fetched networks; some may not be there.
    #[serde(skip)]
    folder: Option<PathBuf>,
}

/// A network that is known by name.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownTeacher {
    /// Name for users: lower-case letters, digits and dashes.
    pub name: String,
    /// Recommended use, in words.
    pub about: String,
    /// Under which license its host gives it away.
    pub license: String,
    /// The built-in profile that it follows.
    pub profile: String,
    /// Side in pixels at which it sees photos, where that is not the profile's.
    pub size: Option<u32>,
    /// Length of its file, where published.
    pub bytes: Option<u64>,
    /// Address of its file, `https`.
    pub url: String,
    /// SHA-256 of its file in lower-case hexadecimal.
    pub sha256: String,
}

impl Catalog {
    /// The table that `GS_CHROMA_TEACHERS` names, or the program's own.
    ///
    /// # Errors
    /// [`TeacherError::Io`], [`TeacherError::BadCatalog`] where it names the file and the
    /// network that is not described well.
    pub fn open() -> Result<Self, TeacherError> {
        let path = env::var_os(VARIABLE).filter(|path| !path.is_empty());
        let path = path.map(PathBuf::from);
        let text = match &path {
            Some(path) => &input::read_to_string(path).map_err(TeacherError::io(path))?,
            None => BUILT_IN,
        };
        Self::parse(text).map_err(|reason| TeacherError::BadCatalog {
            path: path.unwrap_or_else(|| "teachers.toml".into()),
            reason,
        })
    }

    fn parse(text: &str) -> Result<Self, String> {
        let mut catalog: Self =
            toml::from_str(text).map_err(|error| error.message().replace('\n', " "))?;
        for (i, teacher) in catalog.teachers.iter().enumerate() {
            let same = |other: &KnownTeacher| other.name == teacher.name;
            if catalog.teachers[..i].iter().any(same) {
                return Err(format!("{}: is there twice", teacher.name));
            }
            teacher
                .check()
                .map_err(|reason| format!("{}: {reason}", teacher.name))?;
        }
        catalog.folder = cache_folder("teachers");
        Ok(catalog)
    }

    /// The network of this name.
    ///
    /// # Errors
    /// [`TeacherError::UnknownTeacher`].
    pub fn find(&self, name: &str) -> Result<&KnownTeacher, TeacherError> {
        let found = self.teachers.iter().find(|teacher| teacher.name == name);
        found.ok_or_else(|| {
            let names: Vec<_> = self.teachers.iter().map(|t| t.name.as_str()).collect();
            TeacherError::UnknownTeacher {
                name: name.to_owned(),
                known: names.join(", "),
            }
        })
    }

    /// Path of a network once it is fetched.
    ///
    /// # Errors
    /// [`TeacherError::NoCacheFolder`].
    pub fn path(&self, teacher: &KnownTeacher) -> Result<PathBuf, TeacherError> {
        let folder = self.folder.as_ref().ok_or(TeacherError::NoCacheFolder)?;
        Ok(folder.join(format!("{}.onnx", teacher.name)))
    }

    /// Returns true if a network is on this machine.
    ///
    /// # Errors
    /// [`TeacherError::OtherBytes`] where something else has its place, [`TeacherError::Io`],
    /// [`TeacherError::NoCacheFolder`].
    pub fn is_fetched(&self, teacher: &KnownTeacher) -> Result<bool, TeacherError> {
        let path = self.path(teacher)?;
        if !path.is_file() {
            return Ok(false);
        }
        let sha256 = input::open(&path).and_then(hash::of_file);
        let sha256 = sha256.map_err(TeacherError::io(&path))?;
        self.identify(&path, &sha256).map(|_| true)
    }

    /// The file or folder that a user means: what is at this path, or else the network of this
    /// name.
    pub(super) fn locate(&self, path: &Path) -> Result<PathBuf, TeacherError> {
        let name = path.to_str().filter(|name| is_name(name));
        let Some(name) = name.filter(|_| !path.exists()) else {
            return Ok(path.to_path_buf());
        };
        let teacher = self.find(name)?;
        let path = self.path(teacher)?;
        match path.is_file() {
            true => Ok(path),
            false => Err(TeacherError::NotFetched {
                name: name.to_owned(),
            }),
        }
    }

    /// Entry of the file at this path with this SHA-256, if it is known.
    ///
    /// # Errors
    /// [`TeacherError::OtherBytes`] where a network that is kept under its name is not that.
    pub(super) fn identify(
        &self,
        path: &Path,
        sha256: &str,
    ) -> Result<Option<&KnownTeacher>, TeacherError> {
        let mut teachers = self.teachers.iter();
        if let Some(named) = teachers
            .clone()
            .find(|teacher| self.path(teacher).is_ok_and(|at| at == path))
            && named.sha256 != sha256
        {
            return Err(TeacherError::OtherBytes {
                path: path.to_path_buf(),
                name: named.name.clone(),
            });
        }
        Ok(teachers.find(|teacher| teacher.sha256 == sha256))
    }
}

impl KnownTeacher {
    /// Its profile, with this entry's size if it has one.
    pub(super) fn contract(&self) -> Result<Profile, TeacherError> {
        let profile = named(&self.profile)?;
        let size = self.size.unwrap_or(profile.size);
        Ok(Profile { size, ..profile })
    }

    fn check(&self) -> Result<(), String> {
        let digit = |c: u8| c.is_ascii_digit() || (b'a'..=b'f').contains(&c);
        if !is_name(&self.name) {
            return Err("name: must be lower-case letters, digits and dashes".to_owned());
        }
        if self.sha256.len() != 64 || !self.sha256.bytes().all(digit) {
            return Err("sha256: must be 64 lower-case hexadecimal digits".to_owned());
        }
        if !self.url.starts_with("https://") {
            return Err("url: must begin with https://".to_owned());
        }
        let contract = self
            .contract()
            .map_err(|error| format!("profile: {error}"))?;
        contract.check()
    }
}

/// Returns true if it can be the name of a network; paths to `.onnx` files cannot.
fn is_name(name: &str) -> bool {
    let plain = |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'-';
    !name.is_empty() && name.bytes().all(plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn catalog(folder: &Path) -> Catalog {
        let mut catalog = Catalog::parse(BUILT_IN).unwrap();
        catalog.folder = Some(folder.to_path_buf());
        catalog
    }

    #[test]
    fn the_bundled_table_is_sound() {
        let catalog = Catalog::parse(BUILT_IN).unwrap();
        assert!(catalog.teachers.len() >= 7);
        for teacher in &catalog.teachers {
            let host = teacher.url.split('/').nth(2).unwrap();
            assert!(catalog.hosts.iter().any(|h| h == host), "{host}");
            assert!(!teacher.license.is_empty() && !teacher.about.is_empty());
        }
    }

    #[test]
    fn what_makes_no_table() {
        let sha = "0".repeat(64);
        let table = |name: &str, profile: &str, url: &str, sha: &str| {
            format!(
                "hosts = []\n[[teachers]]\nname = \"{name}\"\nabout = \"\"\nlicense = \"\"\n\
                 profile = \"{profile}\"\nurl = \"{url}\"\nsha256 = \"{sha}\"\n"
            )
        };
        let good = table("a-1", "ddcolor", "https://a", &sha);
        assert!(Catalog::parse(&good).is_ok());
        let twice = format!("{good}{}", good.replace("hosts = []", ""));
        for (text, reason) in [
            (twice, "a-1: is there twice"),
            (table("A", "ddcolor", "https://a", &sha), "A: name:"),
            (table("a", "colorist", "https://a", &sha), "a: profile:"),
            (table("a", "ddcolor", "http://a", &sha), "a: url:"),
            (table("a", "ddcolor", "https://a", "12"), "a: sha256:"),
            (good.replace("hosts = []", ""), "hosts"),
            (good.replace("about", "abuot"), "abuot"),
        ] {
            let message = Catalog::parse(&text).unwrap_err();
            assert!(message.contains(reason), "{message}");
        }
    }

    #[test]
    fn paths_come_before_names() {
        let place = tempfile::tempdir().unwrap();
        let catalog = catalog(place.path());
        let locate = |name: &str| {
            let located = catalog.locate(Path::new(name));
            located.map_err(|error| error.to_string())
        };
        // A path that leads nowhere is left to whoever opens it.
        assert_eq!(locate("a/eccv16"), Ok("a/eccv16".into()));
        assert_eq!(locate("nothing.onnx"), Ok("nothing.onnx".into()));
        assert_eq!(locate("src"), Ok("src".into()));
        let unknown = locate("painted-frames").unwrap_err();
        assert!(unknown.contains("eccv16, "), "{unknown}");
        let missing = locate("eccv16").unwrap_err();
        assert!(missing.contains("eccv16: not on this machine"), "{missing}");
        let kept = place.path().join("eccv16.onnx");
        std::fs::write(&kept, "").unwrap();
        assert_eq!(locate("eccv16"), Ok(kept));
    }

    #[test]
    fn a_file_is_what_its_hash_says() {
        let place = tempfile::tempdir().unwrap();
        let catalog = catalog(place.path());
        let known = catalog.find("eccv16").unwrap();
        let identify = |path: &Path, sha: &str| {
            let known = catalog.identify(path, sha);
            known.map(|known| known.map(|known| known.name.clone()))
        };
        let elsewhere = Path::new("mine.onnx");
        let found = identify(elsewhere, &known.sha256).unwrap();
        assert_eq!(found.as_deref(), Some("eccv16"));
        assert_eq!(identify(elsewhere, "00").unwrap(), None);
        let message = identify(&catalog.path(known).unwrap(), "00")
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("eccv16") && message.contains("delete"),
            "{message}"
        );
    }
}
