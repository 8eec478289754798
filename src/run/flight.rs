//! A film of a path's frames.

use std::{
    fs,
    io::ErrorKind,
    path::Path,
    process::{Command, Stdio},
};

use super::{Event, Observer};
use crate::report::{Flight, PathScore};

/// What makes it, where it is on the PATH.
const ENCODER: &str = "ffmpeg";

/// Frames a second: slow enough to see what changes between two of them.
const RATE: u32 = 12;

/// Its file.
const FILM: &str = "flight.mp4";

/// What the page in this folder shows of a path: a film where one can be made, its frames where
/// not.
pub(super) fn flight(page: &Path, path: &PathScore, observe: &mut Observer<'_>) -> Flight {
    let film = match make_film(page, FILM) {
        Ok(made) => made.then(|| FILM.to_owned()),
        Err(reason) => {
            observe(Event::Warning(format!("no film of the path: {reason}")));
            None
        }
    };
    let bytes_of = |name: &str| fs::metadata(page.join(name)).map_or(0, |file| file.len());
    let of_frames = || (0..path.frames).map(|k| bytes_of(&format!("frame-{k:04}.png")));
    Flight {
        frames: path.frames,
        size: path.size,
        rate: RATE,
        bytes: match &film {
            Some(film) => bytes_of(film),
            None => of_frames().sum(),
        },
        film,
    }
}

/// Makes `film` of `frame-0000.png` and so on in a folder, in H.264, which browsers play; `false`
/// where nothing makes films.
///
/// # Errors
/// What the encoder says.
fn make_film(folder: &Path, film: &str) -> Result<bool, String> {
    let rate = RATE.to_string();
    let made = Command::new(ENCODER)
        .args(["-nostdin", "-loglevel", "error", "-y"])
        .args(["-framerate", &rate, "-i", "frame-%04d.png"])
        // Half as many a and b as pixels: both sides have to be even.
        .args([
            "-vf",
            "pad=ceil(iw/2)*2:ceil(ih/2)*2",
            "-pix_fmt",
            "yuv420p",
        ])
        .args(["-c:v", "libx264", "-crf", "18", "-movflags", "+faststart"])
        .arg(film)
        // A folder's name may hold what it takes for a pattern.
        .current_dir(folder)
        .stdin(Stdio::null())
        .output();
    match made {
        Ok(done) if done.status.success() && folder.join(film).is_file() => Ok(true),
        Ok(done) => {
            let words = String::from_utf8_lossy(&done.stderr);
            let last = words.lines().rfind(|line| !line.trim().is_empty());
            let last = last.map_or_else(|| done.status.to_string(), str::to_owned);
            Err(format!("{ENCODER}: {last}"))
        }
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(format!("{ENCODER}: {error}")),
    }
}
