//! `gs-chroma prepare`.

use std::path::PathBuf;

use clap::{Args, builder::PossibleValuesParser};

use super::{
    CliError, next, print,
    progress::Progress,
    values::{one_of, positive},
};
use crate::capture::lens::MODELS;
use crate::prepare::{Cameras, Matching, PrepareOptions, Prepared, prepare};

const CAMERAS: &[(Cameras, &str)] = &[
    (Cameras::One, "One camera with one lens took all"),
    (Cameras::Folder, "Each folder has its camera"),
    (
        Cameras::Photo,
        "Each photo has its own, as where the lens zooms",
    ),
];

const MATCHINGS: &[(Matching, &str)] = &[
    (
        Matching::Sequential,
        "Each with its neighbors by name, and ever fewer farther away",
    ),
    (Matching::Exhaustive, "Each with each"),
];

/// What is prepared, and how.
#[derive(Args)]
pub struct InputArguments {
    /// A film, or a folder of photos.
    #[arg(value_name = "FILM|DIR")]
    input: PathBuf,
    /// Where in the film the shot begins, in seconds or as 1:05 [default: the longest shot].
    #[arg(long, value_name = "TIME", value_parser = time)]
    start: Option<f64>,
    /// Where it ends [default: the next cut].
    #[arg(long, value_name = "TIME", value_parser = time, requires = "start")]
    end: Option<f64>,
    /// How long it is, in place of --end.
    #[arg(long, value_name = "SECONDS", value_parser = positive::<f64>, requires = "start", conflicts_with = "end")]
    seconds: Option<f64>,
    /// Frames a second that get a pose, each the sharpest of its time [default: 2, but 30 to 120
    /// in all].
    #[arg(long, value_name = "N", value_parser = positive::<f64>)]
    per_second: Option<f64>,
    /// A mask for all photos: white, black where nothing counts. Constant black borders are
    /// masked by themselves.
    #[arg(long, value_name = "FILE.png")]
    mask: Option<PathBuf>,
    /// A folder of masks for single photos: 000001.png.png, or 000001.png, for 000001.png.
    #[arg(long, value_name = "DIR")]
    masks: Option<PathBuf>,
    /// Which photos one camera took [default: one for a film, folder for photos of one size, else
    /// photo].
    #[arg(long, value_name = "WHICH", value_parser = one_of(CAMERAS))]
    cameras: Option<Cameras>,
    /// COLMAP's model of the lens: OPENCV for one with visible distortion, OPENCV_FISHEYE for a
    /// fisheye.
    #[arg(long, value_name = "MODEL", default_value = "SIMPLE_RADIAL", hide_possible_values = true, value_parser = PossibleValuesParser::new(MODELS.map(|model| model.name)))]
    lens: String,
    /// Which photos are matched with which [default: sequential for films and for more than 200
    /// photos].
    #[arg(long = "match", value_name = "HOW", value_parser = one_of(MATCHINGS))]
    matching: Option<Matching>,
    /// Where there is no COLMAP, install its Python module into the cache.
    #[arg(long)]
    install: bool,
}

impl InputArguments {
    /// What was said of it, for an output folder; ends the program where it makes no sense.
    pub(super) fn options(self, output: PathBuf, force: bool) -> PrepareOptions {
        if let (Some(start), Some(end)) = (self.start, self.end)
            && end <= start
        {
            super::fit::refuse("--end has to be later than --start");
        }
        let length = self.start.zip(self.seconds);
        PrepareOptions {
            input: self.input,
            output,
            start: self.start,
            end: self.end.or(length.map(|(start, seconds)| start + seconds)),
            per_second: self.per_second,
            mask: self.mask,
            masks: self.masks,
            cameras: self.cameras,
            lens: self.lens,
            matching: self.matching,
            install: self.install,
            force,
        }
    }
}

/// Make of a film or a folder of photos what `fit` takes: frames, masks and camera poses, with
/// FFmpeg and COLMAP. What was made from the same before stays, so that the same command goes on.
#[derive(Args)]
pub struct Prepare {
    #[command(flatten)]
    input: InputArguments,
    /// Folder to write; one that was prepared before goes on.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Make all of it anew, also from another input.
    #[arg(long)]
    force: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Prepare {
    pub(super) fn run(self) -> Result<(), CliError> {
        let options = self.input.options(self.output, self.force);
        let mut progress = Progress::default();
        let prepared = prepare(&options, &mut |event| progress.show(&event))?;
        progress.finish();
        if self.json {
            return print(format_args!("{:#}", serde_json::json!(prepared)));
        }
        print(in_words(&prepared))?;
        progress.close(&[], &next::fit(&prepared.folder))
    }
}

/// What there is now, and what comes next.
fn in_words(prepared: &Prepared) -> String {
    let Prepared {
        photos,
        masked,
        colmap,
        poses,
        ..
    } = prepared;
    let masks = match masked {
        0 => String::new(),
        masked => format!(", {masked} with a mask"),
    };
    format!(
        "{} of {photos} photos have a pose ({colmap}, {} points){masks}",
        poses.placed, poses.points
    )
}

/// Seconds, or minutes and seconds, or hours, minutes and seconds: `65`, `1:05`, `1:02:03.5`.
fn time(text: &str) -> Result<f64, String> {
    let refused = || "must be a time, such as 65, 1:05 or 1:02:03.5".to_owned();
    let parts: Vec<&str> = text.split(':').collect();
    let digits =
        |part: &str| !part.is_empty() && part.chars().all(|c| c.is_ascii_digit() || c == '.');
    if parts.len() > 3 || !parts.iter().all(|part| digits(part)) {
        return Err(refused());
    }
    parts
        .iter()
        .enumerate()
        .try_fold(0.0, |sum, (place, part)| {
            let value: f64 = part.parse().map_err(|_| refused())?;
            let whole = place + 1 == parts.len() || !part.contains('.');
            let below = place == 0 || value < 60.0;
            match whole && below {
                true => Ok(60.0 * sum + value),
                false => Err(refused()),
            }
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read() {
        for (text, seconds) in [
            ("65", 65.0),
            ("1:05", 65.0),
            ("0.5", 0.5),
            ("1:02:03.5", 3723.5),
        ] {
            assert_eq!(time(text), Ok(seconds));
        }
        for text in [
            "", "1:", "-1", "1:60", "1.5:00", "1:2:3:4", "1e3", "inf", ".",
        ] {
            assert!(time(text).is_err(), "{text}");
        }
    }
}
