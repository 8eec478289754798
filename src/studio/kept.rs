//! Words of the command that makes a run, kept in its folder so that the same command can continue.

use std::path::Path;

use super::error::StudioError;
use crate::{input, store::files};

/// File in the folder of a job's results with the words of its command.
const COMMAND: &str = "studio.json";

/// Place of the folder among the words: `auto INPUT --teacher TEACHER -o FOLDER`.
const OUTPUT: usize = 5;

/// A word that is no option.
pub fn word(text: &str) -> Result<String, StudioError> {
    let text = text.trim();
    match text.is_empty() || text.starts_with('-') {
        true => Err(StudioError::Refused(text.to_owned())),
        false => Ok(text.to_owned()),
    }
}

/// Words of further options, which do not lead the results elsewhere.
pub fn more(text: &str) -> Result<Vec<String>, StudioError> {
    let refused = || StudioError::Refused(text.to_owned());
    let words: Vec<String> = shlex::split(text).ok_or_else(refused)?;
    match words.iter().any(|word| elsewhere(word)) {
        true => Err(refused()),
        false => Ok(words),
    }
}

/// Returns true of an option that names the folder of the results, or may.
fn elsewhere(word: &str) -> bool {
    word.starts_with("--o") || (word.starts_with('-') && !word.starts_with("--"))
}

/// Keeps the words of a command that makes a folder in that folder.
pub fn keep(words: &[String]) -> Result<(), StudioError> {
    let Some(output) = words.get(OUTPUT).map(Path::new) else {
        return Err(StudioError::Gone);
    };
    files::make_folder(output)?;
    let text = serde_json::to_string(words).unwrap_or_default();
    Ok(files::write(&output.join(COMMAND), text.as_bytes())?)
}

/// The words that make a folder; none of a folder that was moved or copied, or where they would
/// lead elsewhere.
pub fn kept(output: &Path) -> Option<Vec<String>> {
    let text = input::read_to_string(&output.join(COMMAND)).ok()?;
    let words: Vec<String> = serde_json::from_str(&text).ok()?;
    let [auto, from, teaches, teacher, leads, place, more @ ..] = &words[..] else {
        return None;
    };
    let own =
        auto == "auto" && teaches == "--teacher" && leads == "-o" && Path::new(place) == output;
    let sound =
        !from.starts_with('-') && word(teacher).is_ok() && !more.iter().any(|word| elsewhere(word));
    (own && sound).then_some(words)
}
