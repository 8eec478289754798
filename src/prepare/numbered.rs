//! Numbered pictures as a film: found in a folder, or by a pattern of their names.

use std::{collections::BTreeSet, fs};

use super::{PrepareError, options::PrepareOptions};
use crate::{
    archive::{NumberedName, dpx},
    disk,
    programs::Pictures,
    store::{files, film::FRAME_RATE},
    tell::{Event, Observer},
};

/// Extensions of pictures that are frames wherever they are, and of those that are photos unless
/// somebody says how many there are a second.
const FRAMES: [&str; 2] = ["dpx", "exr"];
const PERHAPS: [&str; 5] = ["tif", "tiff", "png", "jpg", "jpeg"];

/// The numbered pictures that the input names; `None` where it is something else.
///
/// # Errors
/// [`PrepareError`] where one is missing, or there are several kinds of names.
pub(super) fn find(
    options: &PrepareOptions,
    observe: &mut Observer<'_>,
) -> Result<Option<Pictures>, PrepareError> {
    let input = &options.input;
    let refused = |reason: String| PrepareError::at(input, reason);
    let named = input.file_name().and_then(|name| name.to_str());
    let named = named
        .and_then(NumberedName::parse)
        .filter(|_| !input.exists());
    let folder = match (&named, input.is_dir()) {
        (Some(_), _) => disk::folder_of(input),
        (None, true) => input,
        (None, false) => return Ok(None),
    };
    let folder = fs::canonicalize(folder).map_err(files::at(folder))?;
    let entries = fs::read_dir(&folder).map_err(files::at(&folder))?.flatten();
    let names: Vec<String> = (entries.filter(|entry| entry.path().is_file()))
        .filter_map(|entry| entry.file_name().into_string().ok())
        .collect();
    let is_frame = |name: &NumberedName| {
        let extension = name.extension();
        let perhaps = options.frame_rate.is_some() && PERHAPS.contains(&&*extension);
        perhaps || FRAMES.contains(&&*extension)
    };
    let patterns: BTreeSet<NumberedName> = match &named {
        Some(named) => [named.clone()].into(),
        None => (names.iter().filter_map(|name| NumberedName::of_file(name)))
            .map(|(name, _)| name)
            .filter(is_frame)
            .collect(),
    };
    let numbers = |pattern: &NumberedName| -> BTreeSet<u64> {
        names
            .iter()
            .filter_map(|name| pattern.number(name))
            .collect()
    };
    let Some((name, numbers)) = (patterns.iter().map(|name| (name, numbers(name))))
        .max_by_key(|(_, numbers)| numbers.len())
    else {
        return Ok(None);
    };
    // Numbers that have outgrown their zeros look like another pattern.
    let is_other = |other: &&NumberedName| {
        let all = names.iter().filter(|file| other.number(file).is_some());
        all.into_iter().any(|file| name.number(file).is_none())
    };
    if let Some(other) = patterns.iter().find(is_other) {
        return Err(refused(format!(
            "holds pictures of several names, {name} and {other}; name one of these instead of the folder"
        )));
    }
    let (Some(&first), Some(&last)) = (numbers.first(), numbers.last()) else {
        return Err(refused("no file there has such a name".to_owned()));
    };
    if let Some(missing) = (first..=last).find(|number| !numbers.contains(number)) {
        return Err(refused(format!(
            "{} is missing between {} and {}; put it there, or move those before or after it elsewhere",
            name.name(missing),
            name.name(first),
            name.name(last)
        )));
    }
    let told = dpx::header(&folder.join(name.name(first))).and_then(|header| header.rate);
    let rate = options.frame_rate.or(told).unwrap_or_else(|| {
        observe(Event::Note(format!(
            "the pictures do not say how many are shown a second: taking {}",
            FRAME_RATE[0]
        )));
        FRAME_RATE
    });
    Ok(Some(Pictures {
        folder,
        names: name.to_string(),
        first,
        rate,
    }))
}
