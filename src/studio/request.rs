//! What the page asks for, as command lines.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::{
    error::StudioError,
    kept::{kept, more, word},
    shelf,
};
use crate::run::Preset;

/// What the page asks for.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "do", deny_unknown_fields)]
pub enum StudioRequest {
    /// All steps, of a film, a folder of photos or a COLMAP folder.
    Make {
        input: String,
        name: String,
        teacher: String,
        preset: Option<Preset>,
        /// More options of `auto`.
        #[serde(default)]
        options: String,
    },
    /// A network of the catalog.
    Fetch {
        teacher: String,
    },
    /// The same command as before.
    Resume {
        run: String,
    },
    View {
        run: String,
    },
    Paint {
        run: String,
    },
    /// Photos in color.
    Frames {
        run: String,
        film: bool,
    },
    /// A file for viewers.
    Export {
        run: String,
        format: String,
    },
    /// Ends a command.
    Stop {
        job: usize,
    },
}

/// Formats that the page offers.
const FORMATS: [&str; 4] = ["ply", "spz", "sog", "html"];

impl StudioRequest {
    /// The command line in a studio's folder, and whether it trains or colors.
    ///
    /// # Errors
    /// [`StudioError`]; nothing is started then.
    pub fn words(self, folder: &Path) -> Result<(Vec<String>, bool), StudioError> {
        let of = |run: &str| shelf::find(folder, run).ok_or(StudioError::Gone);
        let text = |path: &Path| path.to_string_lossy().into_owned();
        let view = |run: &str| -> Result<Vec<String>, StudioError> {
            let words = [
                "view".to_owned(),
                text(&of(run)?.path),
                "--no-open".to_owned(),
            ];
            Ok(words.to_vec())
        };
        Ok(match self {
            Self::Make {
                input,
                name,
                teacher,
                preset,
                options,
            } => {
                let input = folder.join(&input);
                let input = input
                    .canonicalize()
                    .map_err(|_| StudioError::NoInput(input))?;
                let output = place(folder, &name)?;
                let mut words = vec!["auto".to_owned(), text(&input)];
                words.extend(["--teacher".to_owned(), word(&teacher)?]);
                words.extend(["-o".to_owned(), text(&output)]);
                if let Some(preset) = preset {
                    words.extend(["--preset".to_owned(), preset.to_string()]);
                }
                words.extend(["--view", "--no-open"].map(str::to_owned));
                words.extend(more(&options)?);
                (words, true)
            }
            Self::Fetch { teacher } => {
                let words = vec!["teacher".to_owned(), "fetch".to_owned(), word(&teacher)?];
                (words, false)
            }
            Self::Resume { run } => (kept(&of(&run)?.path).ok_or(StudioError::Gone)?, true),
            Self::View { run } => (view(&run)?, false),
            Self::Paint { run } => ([view(&run)?, vec!["--paint".to_owned()]].concat(), false),
            Self::Frames { run, film } => {
                let end = if film { "-colored.mp4" } else { "-colored" };
                (of(&run)?.export_words("frames", folder, end)?, false)
            }
            Self::Export { run, format } => {
                let known = FORMATS.contains(&&*format);
                let run = known.then(|| of(&run)).ok_or(StudioError::Gone)??;
                (
                    run.export_words("export", folder, &format!(".{format}"))?,
                    false,
                )
            }
            Self::Stop { .. } => return Err(StudioError::Gone),
        })
    }
}

/// The folder of a new run.
fn place(folder: &Path, name: &str) -> Result<PathBuf, StudioError> {
    let plain = |c: char| c.is_alphanumeric() || "-_. ".contains(c);
    let sound = (1..=80).contains(&name.len()) && !name.starts_with(['.', '-', ' ']);
    if !sound || !name.chars().all(plain) {
        return Err(StudioError::Refused(name.to_owned()));
    }
    let output = folder.join(shelf::RUNS).join(name);
    match output.exists() {
        true => Err(StudioError::Taken(output)),
        false => Ok(output),
    }
}
