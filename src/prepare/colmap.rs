//! Camera poses from COLMAP: the program, or the same as a module of Python.

use std::{
    env,
    ffi::OsString,
    path::{Path, PathBuf},
};

use super::{
    PrepareError,
    options::{Cameras, DATABASE, Matching},
    pycolmap,
};
use crate::{
    capture::lens::MODELS,
    disk,
    programs::{Program, ProgramError},
    store::files,
};

/// As many camera models, the first of [`MODELS`], every version knows.
const KNOWN_TO_ALL: usize = 11;

/// The option that makes features and pairs the same each time.
const SEED: &str = "random_seed";

/// Options of versions before 4 and since, each for what it is called there: no GPU, and hence no
/// display.
const EXTRACTION: [&str; 2] = ["SiftExtraction.use_gpu", "FeatureExtraction.use_gpu"];
const MATCHING: [&str; 2] = ["SiftMatching.use_gpu", "FeatureMatching.use_gpu"];

/// So many frames to either side of one are matched with it.
const OVERLAP: u32 = 10;

/// Input of feature extraction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Features<'a> {
    pub images: &'a Path,
    /// Folder of masks: `NAME.png` for each photo.
    pub masks: Option<&'a Path>,
    pub cameras: Cameras,
    /// COLMAP's name of the camera model.
    pub lens: &'a str,
}

/// Progress of a step: items done and, if known, items in all.
pub(super) type StepProgress<'a> = dyn FnMut(usize, Option<usize>) + 'a;

/// The COLMAP installation that finds poses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Colmap {
    /// The program, in this version.
    Program(String),
    /// A Python that has `pycolmap`, in this version.
    Python(OsString, String),
}

impl Colmap {
    /// The program on `PATH`, else a Python that can import `pycolmap`, whichever knows the lens;
    /// with `install` one is made where there is none.
    ///
    /// # Errors
    /// [`PrepareError::NoColmap`] where there is neither, [`PrepareError::UnknownLens`].
    pub fn find(
        lens: &str,
        install: bool,
        told: &mut dyn FnMut(String),
    ) -> Result<Self, PrepareError> {
        let version = match Program::new("colmap").arg("help").ask() {
            Ok(said) => Some(version(&said)),
            Err(ProgramError::Missing { .. }) => None,
            Err(error) => return Err(error.into()),
        };
        match version {
            Some(version) if knows(lens)? => Ok(Self::Program(version)),
            version => match (pycolmap::find(lens, install, told), version) {
                (Ok((python, version)), _) => Ok(Self::Python(python, version)),
                (Err(PrepareError::NoColmap), Some(version)) => Err(PrepareError::UnknownLens {
                    lens: lens.to_owned(),
                    version,
                }),
                (Err(error), _) => Err(error),
            },
        }
    }

    /// In words.
    pub fn name(&self) -> String {
        match self {
            Self::Program(version) => format!("COLMAP {version}"),
            Self::Python(_, version) => format!("pycolmap {version}"),
        }
    }

    /// Looks for features, and writes them into a new database.
    ///
    /// # Errors
    /// [`ProgramError`].
    pub fn features(
        &self,
        database: &Path,
        of: &Features,
        told: &mut StepProgress,
    ) -> Result<(), PrepareError> {
        let one = match of.cameras {
            Cameras::One => "ImageReader.single_camera",
            Cameras::Folder => "ImageReader.single_camera_per_folder",
            Cameras::Photo => "ImageReader.single_camera_per_image",
        };
        let mut arguments: Vec<Argument> = vec![
            ("database_path", database.into()),
            ("image_path", of.images.into()),
            ("ImageReader.camera_model", of.lens.into()),
            (one, "1".into()),
        ];
        arguments.extend(
            of.masks
                .map(|masks| ("ImageReader.mask_path", masks.into())),
        );
        self.run("feature_extractor", arguments, &EXTRACTION, told)
    }

    /// Matches the photos of a database; those of `pairs`, a file of [`pairs`], where there is
    /// one.
    ///
    /// # Errors
    /// [`ProgramError`].
    pub fn matches(
        &self,
        database: &Path,
        (matching, pairs): (Matching, Option<&Path>),
        told: &mut StepProgress,
    ) -> Result<(), PrepareError> {
        let mut arguments: Vec<Argument> = vec![("database_path", database.into())];
        let command = match (matching, pairs) {
            (Matching::Exhaustive, _) => "exhaustive_matcher",
            (Matching::Sequential, Some(pairs)) => {
                arguments.push(("match_list_path", pairs.into()));
                arguments.push(("match_type", "pairs".into()));
                "matches_importer"
            }
            (Matching::Sequential, None) => {
                arguments.push(("SequentialMatching.overlap", OVERLAP.to_string().into()));
                arguments.push(("SequentialMatching.quadratic_overlap", "1".into()));
                "sequential_matcher"
            }
        };
        self.run(command, arguments, &MATCHING, told)
    }

    /// Finds poses, and writes models into `0`, `1`, … below a folder that is there.
    ///
    /// # Errors
    /// [`ProgramError`].
    pub fn poses(
        &self,
        database: &Path,
        images: &Path,
        models: &Path,
        told: &mut StepProgress,
    ) -> Result<(), PrepareError> {
        let arguments = vec![
            ("database_path", database.into()),
            ("image_path", images.into()),
            ("output_path", models.into()),
        ];
        self.run("mapper", arguments, &[], told)
    }

    /// Runs a command; `without_gpu` are options that it may know.
    fn run(
        &self,
        command: &str,
        mut arguments: Vec<Argument>,
        without_gpu: &[&'static str],
        told: &mut StepProgress,
    ) -> Result<(), PrepareError> {
        let program = match self {
            Self::Program(_) => {
                let said = Program::new("colmap").args([command, "--help"]).ask()?;
                arguments.extend(known(&said, without_gpu).chain(known(&said, &[SEED])));
                let program = Program::new("colmap").arg(command);
                (arguments.into_iter()).fold(program, |program, (name, value)| {
                    program.option(&format!("--{name}"), value)
                })
            }
            Self::Python(python, _) => {
                arguments.push((SEED, "0".into()));
                let program = pycolmap::program(python, command);
                (arguments.into_iter()).fold(program, |program, (name, value)| {
                    program.option(name, value)
                })
            }
        };
        // COLMAP leaves nothing where it runs.
        program.run(Path::new("."), &mut |line| {
            if let Some((done, total)) = progress(line) {
                told(done, total);
            }
        })?;
        Ok(())
    }
}

/// An option of a command of COLMAP's, and its value.
type Argument = (&'static str, OsString);

/// Those of some options that a command knows, by what its `--help` says, each with 0.
fn known(said: &str, names: &[&'static str]) -> impl Iterator<Item = Argument> {
    let is_known = |name: &&&str| {
        let mut words = said.split_whitespace();
        words.any(|word| word.strip_prefix("--") == Some(**name))
    };
    (names.iter().filter(is_known)).map(|&name| (name, "0".into()))
}

/// True if the program has a camera model of this name.
fn knows(lens: &str) -> Result<bool, PrepareError> {
    if MODELS[..KNOWN_TO_ALL]
        .iter()
        .any(|model| model.name == lens)
    {
        return Ok(true);
    }
    let none = disk::create_folder("gs-chroma-", &env::temp_dir());
    let none = none.map_err(files::at(&env::temp_dir()))?;
    let mut unknown = false;
    let features = Program::new("colmap")
        .arg("feature_extractor")
        .option("--database_path", none.path().join(DATABASE))
        .option("--image_path", none.path())
        .option("--ImageReader.camera_model", lens);
    // That there is no photo may be an error of its own.
    let _ = features.run(none.path(), &mut |line| {
        unknown |= ["Camera model does not exist", "ExistsCameraModel"]
            .iter()
            .any(|words| line.contains(words));
    });
    Ok(!unknown)
}

/// The version in what `colmap help` says.
fn version(said: &str) -> String {
    let mut words = said.split_whitespace().skip_while(|word| *word != "COLMAP");
    let named = words
        .nth(1)
        .filter(|word| word.starts_with(|c: char| c.is_ascii_digit()));
    named.unwrap_or("of an unknown version").to_owned()
}

/// Progress that a line of COLMAP's output reports: items done and, if known, items in all.
fn progress(line: &str) -> Option<(usize, Option<usize>)> {
    let words = [
        "Processed file [",
        "Matching image [",
        "Processing image [",
        "Matching block [",
        "Processing block [",
    ];
    if let Some((_, rest)) = words.iter().find_map(|word| line.split_once(word)) {
        let inside = rest.split(']').next()?;
        let parts = inside.split(',').map(|part| {
            let (done, total) = part.trim().split_once('/')?;
            Some((done.trim().parse().ok()?, total.trim().parse().ok()?))
        });
        // Blocks are counted in rows and columns.
        return parts
            .collect::<Option<Vec<(usize, usize)>>>()
            .and_then(|parts| match parts[..] {
                [(done, total)] => Some((done, Some(total))),
                [(row, rows), (column, columns)] => {
                    let done = row
                        .checked_sub(1)?
                        .checked_mul(columns)?
                        .checked_add(column)?;
                    Some((done, rows.checked_mul(columns)))
                }
                _ => None,
            });
    }
    // `Registering image #7 (12)`, since 3.12 `(num_reg_frames=12)`.
    let (_, rest) = line.split_once("Registering image #")?;
    let (_, count) = rest.split_once('(')?;
    let digits = count.trim_start_matches(|c: char| !c.is_ascii_digit());
    let end = digits
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(digits.len());
    Some((digits[..end].parse().ok()?, None))
}

/// The pairs of photos, in an order of theirs, that a sequential matcher looks at, a line each.
/// `None` where a name cannot stand there.
pub(super) fn pairs(names: &[&str]) -> Option<String> {
    let odd = |name: &&str| name.starts_with('#') || name.contains(char::is_whitespace);
    if names.iter().any(odd) {
        return None;
    }
    let mut lines = String::new();
    for (at, name) in names.iter().enumerate() {
        let near = 1..=OVERLAP as usize;
        let far = (0..OVERLAP)
            .map(|step| 1 << step)
            .filter(|step| !near.contains(step));
        let others = near
            .clone()
            .chain(far)
            .filter_map(|step| names.get(at + step));
        others.for_each(|other| lines += &format!("{name} {other}\n"));
    }
    Some(lines)
}

/// The folders `0`, `1`, … that a mapper wrote, in order.
pub(super) fn models(folder: &Path) -> Vec<PathBuf> {
    (0..)
        .map(|number: usize| folder.join(number.to_string()))
        .take_while(|model| model.is_dir())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_read() {
        let help = "COLMAP 3.8 -- Structure-from-Motion and Multi-View Stereo\n  (Commit Unknown)";
        assert_eq!(version(help), "3.8");
        let logged = "I20250101 10:00:00 1 main.cc:3] COLMAP 4.1.0.dev0 (Commit abc)";
        assert_eq!(version(logged), "4.1.0.dev0");
        assert_eq!(version("nothing"), "of an unknown version");
    }

    #[test]
    fn a_command_is_given_what_it_knows() {
        let help =
            "  -h [ --help ]\n  --random_seed arg (=0)\n  --SiftExtraction.use_gpu arg (=1)\n";
        let given = |names: &[&'static str]| known(help, names).collect::<Vec<_>>();
        assert_eq!(given(&EXTRACTION), [("SiftExtraction.use_gpu", "0".into())]);
        assert_eq!(given(&[SEED]), [("random_seed", "0".into())]);
        assert_eq!(given(&MATCHING), []);
    }

    #[test]
    fn progress_is_read() {
        for (line, expected) in [
            ("Processed file [3/14]", Some((3, Some(14)))),
            (
                "I20250101 1 a.cc:2] Processed file [3/14]",
                Some((3, Some(14))),
            ),
            ("Matching image [11/14] in 0.156s", Some((11, Some(14)))),
            ("Processing image [1/20]", Some((1, Some(20)))),
            ("Matching block [2/3, 1/3] in 0.2s", Some((4, Some(9)))),
            ("Matching block [0/3, 1/3]", None),
            ("Registering image #11 (3)", Some((3, None))),
            (
                "Registering image #11 (num_reg_frames=30)",
                Some((30, None)),
            ),
            ("Registering image #11", None),
            ("Processed file [x/14]", None),
            ("Bundle adjustment", None),
        ] {
            assert_eq!(progress(line), expected, "{line}");
        }
    }
}
