//! `film.json`: which film the photos of a capture come from.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::error::CaptureError;
use crate::{disk, input};

/// The file, in the folder of a capture.
const FILE: &str = "film.json";

/// Folder of a capture that holds all frames of its film.
pub const FRAMES: &str = "frames";

/// Seconds of a shot at most, a day: its frames are counted.
const LONGEST: f64 = 86_400.0;

/// One shot of a film: all its frames lie in `frames/`, and some of them, under the same
/// names, in `images/`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Film {
    /// The film's file, absolute.
    pub source: PathBuf,
    /// When the first frame is shown in the film, in seconds.
    pub start: f64,
    /// Duration of all frames, in seconds.
    pub seconds: f64,
    /// Frames a second: numerator and denominator.
    ///
    /// Both positive.
    pub frame_rate: [u32; 2],
    /// True if the film has sound.
    pub audio: bool,
    /// Width and height of a frame, in pixels.
    pub size: [u32; 2],
    /// Names of all frames in order, below `frames/`.
    ///
    /// At least one.
    pub frames: Vec<String>,
    /// When each frame is shown, in seconds after `start`; `None` where they follow each other at
    /// the frame rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<Vec<f64>>,
    /// The pictures as the film's file has them; `None` where an earlier version prepared them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<Signal>,
}

/// Pictures of a film as its file has them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Signal {
    /// Bits of a channel, 8 to 16.
    pub bits: u32,
    /// FFmpeg's name of the pixel format.
    pub pixel_format: String,
    /// FFmpeg's name of the transfer characteristic; `None` where the file does not say.
    pub transfer: Option<String>,
    /// Number of the transfer characteristic in DPX files; `None` of others.
    pub dpx_transfer: Option<u8>,
    /// FFmpeg's name of the field order; `None` where the file does not say.
    ///
    /// Frames are progressive.
    pub field_order: Option<String>,
    /// Width over height of a pixel.
    ///
    /// Those of frames are square.
    pub pixel_aspect: [u32; 2],
    /// Time code of the first frame; `None` where the film has none.
    pub timecode: Option<String>,
    /// Names of numbered pictures, such as `scan_%07d.dpx`; `None` where the film is one file.
    pub names: Option<String>,
    /// Number of the first frame in them; 0 where the film is one file.
    pub first: u64,
}

impl Film {
    /// The film of a capture's folder; none where its photos are no frames.
    ///
    /// # Errors
    /// If the file cannot be read or contradicts itself.
    pub fn read(dir: &Path) -> Result<Option<Self>, CaptureError> {
        let path = dir.join(FILE);
        let text = match input::read_to_string(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            read => read.map_err(CaptureError::read(&path))?,
        };
        let film: Result<Self, String> =
            serde_json::from_str(&text).map_err(|error| error.to_string());
        let sound = film.and_then(|film| film.check().map(|()| film));
        sound
            .map(Some)
            .map_err(|reason| CaptureError::Film { path, reason })
    }

    /// Writes it into a capture's folder, whole or not at all.
    ///
    /// # Errors
    /// The system's, and if the film's path is no UTF-8.
    pub fn write(&self, dir: &Path) -> io::Result<()> {
        let path = dir.join(FILE);
        let mut text = serde_json::to_vec_pretty(self)?;
        text.push(b'\n');
        let mut file = disk::create(&path)?;
        file.write_all(&text)?;
        file.persist(&path)
    }

    /// Repetitions of each frame at a frame rate that keep all frames at their times: one, unless
    /// they have times of their own, or the film has sound and another rate.
    pub fn repeats(&self, rate: [u32; 2]) -> Vec<usize> {
        let per_second = |[frames, seconds]: [u32; 2]| f64::from(frames) / f64::from(seconds);
        let own = per_second(self.frame_rate);
        let rate = per_second(rate);
        let times = match &self.times {
            Some(times) => times.clone(),
            None if self.audio && rate != own => {
                (0..self.frames.len()).map(|i| i as f64 / own).collect()
            }
            None => return vec![1; self.frames.len()],
        };
        let number = |time: f64| (time * rate).round().max(0.0) as usize;
        let ends = times.iter().skip(1).copied().chain([self.seconds]);
        let mut shown = 0;
        let repeats = ends.map(|end| {
            let before = shown;
            shown = number(end).max(before);
            shown - before
        });
        let mut repeats: Vec<usize> = repeats.collect();
        // A film that is shorter than half a frame has one.
        if let (Some(first), 0) = (repeats.first_mut(), shown) {
            *first = 1;
        }
        repeats
    }

    /// Checks that times, rate, size and names are valid; the error names the field.
    fn check(&self) -> Result<(), String> {
        let time = |seconds: f64| seconds.is_finite() && seconds >= 0.0;
        let plain =
            |name: &str| !(name.is_empty() || name.starts_with('.') || name.contains(['/', '\\']));
        let wrong = if !(time(self.start) && time(self.seconds) && self.seconds <= LONGEST) {
            "start and seconds have to be times".to_owned()
        } else if self.frame_rate.contains(&0) {
            "frame_rate has to be positive".to_owned()
        } else if self.size.contains(&0) {
            "size has to be positive".to_owned()
        } else if self.frames.is_empty() {
            "frames is empty".to_owned()
        } else if self.times.as_ref().is_some_and(|times| {
            times.len() != self.frames.len()
                || times.iter().any(|&at| !time(at) || at > LONGEST)
                || !times.is_sorted()
        }) {
            "times has to be a time for each frame, in order".to_owned()
        } else if let Some(name) = self.frames.iter().find(|name| !plain(name)) {
            format!("{name:?} is no name of a frame")
        } else {
            return Ok(());
        };
        Err(wrong)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film() -> Film {
        Film {
            source: "/films/street.mp4".into(),
            start: 65.0,
            seconds: 20.0,
            frame_rate: [24000, 1001],
            audio: true,
            size: [640, 480],
            frames: vec!["000001.png".to_owned(), "000002.png".to_owned()],
            times: None,
            signal: None,
        }
    }

    #[test]
    fn it_is_read_as_it_was_written() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(Film::read(dir.path()).unwrap(), None);
        film().write(dir.path()).unwrap();
        assert_eq!(Film::read(dir.path()).unwrap(), Some(film()));
    }

    #[test]
    fn frames_are_shown_as_long_as_they_were() {
        assert_eq!(film().repeats([24000, 1001]), [1, 1]);
        let silent = Film {
            audio: false,
            ..film()
        };
        assert_eq!(silent.repeats([48, 1]), [1, 1]);
        // What has sound keeps the time at any rate.
        let even = Film {
            seconds: 0.8,
            frame_rate: [5, 1],
            frames: vec![String::new(); 4],
            ..film()
        };
        assert_eq!(even.repeats([10, 1]), [2; 4]);
        assert_eq!(even.repeats([25, 10]), [1, 0, 1, 0]);
        assert_eq!(even.repeats([1, 10]), [1, 0, 0, 0]);
        let film = Film {
            seconds: 1.0,
            frames: vec![String::new(); 4],
            times: Some(vec![0.0, 0.4, 0.5, 0.501]),
            ..film()
        };
        assert_eq!(film.repeats([10, 1]), [4, 1, 0, 5]);
        assert_eq!(film.repeats([30000, 1001]).iter().sum::<usize>(), 30);
    }

    #[test]
    fn what_cannot_be_is_refused_by_name() {
        let dir = tempfile::tempdir().unwrap();
        type Change = (&'static str, fn(&mut Film));
        let changes: [Change; 7] = [
            ("seconds", |f| f.seconds = -1.0),
            ("frame_rate", |f| f.frame_rate[1] = 0),
            ("size", |f| f.size[0] = 0),
            ("times", |f| f.times = Some(vec![1.0, 0.5])),
            ("frames", |f| f.frames.clear()),
            ("../a.png", |f| f.frames[0] = "../a.png".to_owned()),
            (".png", |f| f.frames[0] = ".png".to_owned()),
        ];
        for (word, change) in changes {
            let mut film = film();
            change(&mut film);
            film.write(dir.path()).unwrap();
            let error = Film::read(dir.path()).unwrap_err().to_string();
            assert!(error.contains(word) && error.contains(FILE), "{error}");
        }
        std::fs::write(dir.path().join(FILE), "{").unwrap();
        assert!(Film::read(dir.path()).is_err());
    }
}
