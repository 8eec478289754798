//! A film of pictures, by ffmpeg.

use std::path::{Path, PathBuf};

use image::RgbImage;

use super::{RunError, files};
use crate::{
    capture::Film,
    disk::{self, Draft},
    frames::Colored,
    programs::{FFMPEG, Fed, Program, ProgramError},
};

/// Frames a second where nobody says: film's.
pub(super) const FRAME_RATE: [u32; 2] = [24, 1];

/// Extensions of films.
const FILMS: [&str; 4] = ["mp4", "mov", "mkv", "m4v"];

/// Chroma finer than lightness calls for: color is what was made here. With it the frames of an old
/// film differ by a tenth less in a and b, for 4 % more bytes.
const CHROMA: &str = "chroma-qp-offset=-6";

/// Whether a path names a film and not a folder.
pub fn is_film(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let known = |film: &&str| extension.eq_ignore_ascii_case(film);
    FILMS.iter().any(known) && !path.is_dir()
}

/// What a film is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// To be worked on: hardly to be told from its pictures, and of their very size.
    Editing,
    /// To be looked at in a browser: chroma at half size, and so a side that is odd grows.
    Viewing,
}

impl Purpose {
    /// Constant rate factor of H.264.
    fn quality(self) -> &'static str {
        match self {
            Self::Editing => "14",
            Self::Viewing => "18",
        }
    }
}

/// Writes a film frame by frame.
pub(super) struct FilmWriter {
    path: PathBuf,
    rate: [u32; 2],
    purpose: Purpose,
    /// The film that sound is taken from, where it begins and how long it is, in seconds.
    sound: Option<(PathBuf, f64, f64)>,
    started: Option<Started>,
}

struct Started {
    // Ended before its file is removed.
    encoder: Fed,
    /// Until it is in its place.
    draft: Draft,
    size: [u32; 2],
    deep: bool,
}

impl FilmWriter {
    /// A film at `path` of so many frames a second, as a fraction.
    ///
    /// # Errors
    /// [`ProgramError::Missing`] where ffmpeg is not there.
    pub fn new(path: &Path, rate: [u32; 2], purpose: Purpose) -> Result<Self, ProgramError> {
        Program::new(FFMPEG).arg("-version").ask()?;
        Ok(Self {
            path: path.to_owned(),
            rate,
            purpose,
            sound: None,
            started: None,
        })
    }

    /// The same with the sound of another film, where it has some and is there.
    pub fn sounding_like(mut self, film: Option<&Film>) -> Self {
        let sounding = film.filter(|film| film.audio && film.source.is_file());
        self.sound = sounding.map(|film| (film.source.clone(), film.start, film.seconds));
        self
    }

    /// Adds a photo in color; `name` is for errors.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_colored(&mut self, name: &str, colored: &Colored) -> Result<(), RunError> {
        let size = [colored.width, colored.height];
        match self.started(size, colored.deep)?.deep {
            true => self.add(name, size, bytemuck::cast_slice(&colored.rgb)),
            false => self.add(name, size, &colored.bytes()),
        }
    }

    /// Adds a picture; `name` is for errors.
    ///
    /// # Errors
    /// [`RunError::File`] where it has another size than those before, or ffmpeg fails.
    pub fn write(&mut self, name: &str, picture: &RgbImage) -> Result<(), RunError> {
        let size = [picture.width(), picture.height()];
        self.started(size, false)?;
        self.add(name, size, picture.as_raw())
    }

    fn started(&mut self, size: [u32; 2], deep: bool) -> Result<&mut Started, RunError> {
        let started = match self.started.take() {
            Some(started) => started,
            None => self.start(size, deep)?,
        };
        Ok(self.started.insert(started))
    }

    fn add(&mut self, name: &str, size: [u32; 2], bytes: &[u8]) -> Result<(), RunError> {
        let Some(started) = &mut self.started else {
            return Ok(());
        };
        if started.size != size {
            let [[width, height], [w, h]] = [size, started.size];
            return Err(RunError::File {
                path: self.path.clone(),
                reason: format!(
                    "{name} has {width} x {height} pixels, those before {w} x {h}: a film's frames have one size; write them to a folder"
                ),
            });
        }
        let written = started.encoder.write(bytes);
        written.map_err(|error| self.failed(&error))
    }

    /// Ends the film and puts it in its place.
    ///
    /// # Errors
    /// [`RunError::File`] where ffmpeg fails.
    pub fn finish(mut self) -> Result<(), RunError> {
        let Some(Started { encoder, draft, .. }) = self.started.take() else {
            return Ok(());
        };
        encoder.finish().map_err(|error| self.failed(&error))?;
        draft.persist(&self.path).map_err(files::at(&self.path))
    }

    fn failed(&self, error: &ProgramError) -> RunError {
        RunError::File {
            path: self.path.clone(),
            reason: error.to_string(),
        }
    }

    fn start(&self, [width, height]: [u32; 2], deep: bool) -> Result<Started, RunError> {
        let draft = disk::create(&self.path).map_err(files::at(&self.path))?;
        let extension = self.path.extension().unwrap_or_default().to_string_lossy();
        let container = match extension.to_ascii_lowercase().as_str() {
            "mkv" => "matroska",
            "mov" => "mov",
            _ => "mp4",
        };
        let mut ffmpeg = Program::new(FFMPEG)
            .args(["-hide_banner", "-nostats", "-loglevel", "error", "-y"])
            .args(["-f", "rawvideo"])
            .option("-pix_fmt", if deep { "rgb48" } else { "rgb24" })
            .option("-video_size", format!("{width}x{height}"))
            .option("-framerate", format!("{}/{}", self.rate[0], self.rate[1]))
            .args(["-i", "pipe:0"]);
        if let Some((source, start, seconds)) = &self.sound {
            ffmpeg = ffmpeg
                .option("-ss", start.to_string())
                .option("-t", seconds.to_string())
                .arg("-i")
                .arg(source)
                .args(["-map", "0:v", "-map", "1:a?", "-c:a", "aac", "-b:a", "256k"]);
        }
        // Chroma at half size needs even sides.
        let odd = width % 2 + height % 2 > 0;
        let (pad, pixels) = match (odd, self.purpose) {
            (false, _) => ("", "yuv420p"),
            (true, Purpose::Editing) => ("", "yuv444p"),
            (true, Purpose::Viewing) => ("pad=ceil(iw/2)*2:ceil(ih/2)*2,", "yuv420p"),
        };
        let filters = format!("{pad}scale=in_range=full:out_range=limited:out_color_matrix=bt709");
        ffmpeg = ffmpeg
            .args(["-c:v", "libx264", "-crf", self.purpose.quality()])
            .args(["-pix_fmt", pixels, "-x264-params", CHROMA])
            .option("-vf", filters)
            .args(["-colorspace", "bt709", "-color_primaries", "bt709"])
            .args(["-color_trc", "bt709"]);
        if container != "matroska" {
            // A page shows it before all of it is there.
            ffmpeg = ffmpeg.args(["-movflags", "+faststart"]);
        }
        let ffmpeg = ffmpeg.args(["-f", container]).arg(draft.path());
        Ok(Started {
            encoder: ffmpeg.feed()?,
            draft,
            size: [width, height],
            deep,
        })
    }
}
