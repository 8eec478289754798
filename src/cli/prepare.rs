//! `gs-chroma prepare`.

use std::path::PathBuf;

use clap::{Args, builder::PossibleValuesParser, error::ErrorKind};

use super::{
    CliError,
    headings::{CAMERA, INPUT, MASKS, OUTPUT},
    next, print,
    progress::Progress,
    usage::refuse,
    values::{Rate, folder, one_of, positive, rate},
};
use crate::capture::lens::MODELS;
use crate::prepare::{CameraMotion, Cameras, Matching, PrepareOptions, Prepared, prepare};

const CAMERAS: &[(Cameras, &str)] = &[
    (Cameras::One, "One camera with one lens for all"),
    (Cameras::Folder, "One camera for each folder"),
    (
        Cameras::Photo,
        "A camera for each photo, such as for a zoom lens",
    ),
];

const MOTIONS: &[(CameraMotion, &str)] = &[
    (
        CameraMotion::Moves,
        "From place to place: depth can be found",
    ),
    (
        CameraMotion::Turns,
        "About one place, or it zooms: a panorama without depth",
    ),
    (CameraMotion::Stands, "Not at all"),
];

const MATCHINGS: &[(Matching, &str)] = &[
    (Matching::Sequential, "Each with its neighbors by name"),
    (Matching::Exhaustive, "Each with each; slow for many photos"),
];

/// Input of `prepare` and its options.
#[derive(Args)]
pub struct InputArguments {
    /// A film, numbered pictures, or a folder of photos.
    ///
    /// Numbered pictures are a folder of DPX or EXR, or scan_%06d.tif.
    #[arg(value_name = "FILM|DIR")]
    input: PathBuf,
    /// Start of the shot in the film, such as 65 or 1:05.
    #[arg(long, help_heading = INPUT, value_name = "TIME", value_parser = time)]
    start: Option<f64>,
    /// End of the shot [default: the next cut].
    #[arg(long, help_heading = INPUT, value_name = "TIME", value_parser = time, requires = "start")]
    end: Option<f64>,
    /// Length of the shot, instead of --end.
    #[arg(long, help_heading = INPUT, value_name = "SECONDS", value_parser = positive::<f64>, requires = "start", conflicts_with = "end")]
    seconds: Option<f64>,
    /// Number of the shot, from 1, instead of --start.
    #[arg(long, help_heading = INPUT, value_name = "N", value_parser = clap::value_parser!(u16).range(1..), conflicts_with = "start")]
    shot: Option<u16>,
    /// Frames per second of numbered pictures [default: their own, or 24].
    ///
    /// Such as 16 or 24000/1001. With it a folder of numbered TIFF, PNG or JPEG is a film.
    #[arg(long, alias = "frame-rate", help_heading = INPUT, value_name = "RATE", value_parser = rate, hide_short_help = true)]
    fps: Option<Rate>,
    /// Frames per second that get a pose [default: 2].
    ///
    /// The sharpest of their time; by default 30 to 120 in all.
    #[arg(long, alias = "per-second", help_heading = INPUT, value_name = "N", value_parser = positive::<f64>)]
    pose_fps: Option<f64>,
    /// One mask for all photos, black where nothing counts.
    ///
    /// Black borders of a film are masked anyway.
    #[arg(long, value_name = "FILE.png", help_heading = MASKS)]
    mask: Option<PathBuf>,
    /// Folder of masks, named like the photos.
    ///
    /// Black where nothing counts. The mask of 000001.png is 000001.png.png or 000001.png.
    #[arg(long, value_name = "DIR", help_heading = MASKS)]
    masks: Option<PathBuf>,
    /// Which photos share a camera [default: by input].
    ///
    /// By default one for a film, folder for photos of one size, else photo.
    #[arg(long, help_heading = CAMERA, value_name = "WHICH", value_parser = one_of(CAMERAS))]
    cameras: Option<Cameras>,
    /// COLMAP's camera model.
    ///
    /// OPENCV for visible distortion, OPENCV_FISHEYE for a fisheye.
    #[arg(long, help_heading = CAMERA, value_name = "MODEL", default_value = "SIMPLE_RADIAL", hide_possible_values = true, value_parser = PossibleValuesParser::new(MODELS.map(|model| model.name)))]
    lens: String,
    /// How the camera moved [default: found out from the matches].
    #[arg(long, hide_short_help = true, help_heading = CAMERA, value_name = "HOW", value_parser = one_of(MOTIONS))]
    camera: Option<CameraMotion>,
    /// How photos are matched [default: sequential for films and more than 200 photos].
    #[arg(long = "match", hide_short_help = true, help_heading = CAMERA, value_name = "HOW", value_parser = one_of(MATCHINGS))]
    matching: Option<Matching>,
    /// Install pycolmap into the cache if COLMAP is missing.
    #[arg(long, help_heading = CAMERA)]
    install: bool,
}

impl InputArguments {
    /// Options for an output folder; ends the program where they contradict each other.
    pub(super) fn options(self, output: PathBuf, force: bool) -> PrepareOptions {
        if let (Some(start), Some(end)) = (self.start, self.end)
            && end <= start
        {
            refuse(
                ErrorKind::ValueValidation,
                "--end has to be later than --start",
            );
        }
        let length = self.start.zip(self.seconds);
        PrepareOptions {
            input: self.input,
            output,
            start: self.start,
            end: self.end.or(length.map(|(start, seconds)| start + seconds)),
            shot: self.shot.map(usize::from),
            known_shots: None,
            frame_rate: self.fps.map(|Rate(rate)| rate),
            per_second: self.pose_fps,
            mask: self.mask,
            masks: self.masks,
            cameras: self.cameras,
            lens: self.lens,
            camera: self.camera,
            matching: self.matching,
            install: self.install,
            force,
        }
    }
}

/// Find the camera poses of photos or a film, for fit.
///
/// Writes a COLMAP folder. Runs FFmpeg and COLMAP: frames of one shot, masks of black borders,
/// poses. The same command continues after an interruption, and redoes only what its options or
/// your photos have changed.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma prepare photos/ -o house
  gs-chroma prepare film.mp4 -o house --start 1:05 --seconds 20
  gs-chroma prepare scan/ -o house --fps 16
  gs-chroma prepare photos/ -o house --lens OPENCV_FISHEYE --cameras one")]
pub struct Prepare {
    #[command(flatten)]
    input: InputArguments,
    /// Folder to write; continues one that was prepared before.
    #[arg(short, long, value_name = "DIR", value_parser = folder(), help_heading = OUTPUT)]
    output: PathBuf,
    /// Start over, also from another input.
    #[arg(long, help_heading = OUTPUT)]
    force: bool,
    /// Print the result as JSON.
    #[arg(long, help_heading = OUTPUT)]
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

/// Summary of the result, in one line.
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
