//! A film of pictures, by ffmpeg.

mod join;
mod sound;

use std::path::{Path, PathBuf};

use image::RgbImage;
use sound::{Sound, in_container};

pub(crate) use join::Piece;

use super::files;
use crate::{
    capture::Film,
    disk::{self, Draft},
    frames::Colored,
    programs::{FFMPEG, PipedProgram, Program, ProgramError},
    store::StoreError,
    tell::{Event, Observer},
};

/// Frames a second where nobody says: film's.
pub(crate) const FRAME_RATE: [u32; 2] = [24, 1];

/// Extensions of films.
const FILMS: [&str; 4] = ["mp4", "mov", "mkv", "m4v"];

/// Chroma finer than lightness calls for: color is what was made here. With it the frames of an old
/// film differ by a tenth less in a and b, for 4 % more bytes.
const CHROMA: &str = "chroma-qp-offset=-6";

/// Returns true if a path names a film and not a folder.
pub fn is_film(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let known = |film: &&str| extension.eq_ignore_ascii_case(film);
    FILMS.iter().any(known) && !path.is_dir()
}

/// Purpose of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
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
pub(crate) struct FilmWriter {
    path: PathBuf,
    rate: [u32; 2],
    purpose: Purpose,
    sound: Option<Sound>,
    started: Option<Started>,
}

struct Started {
    // Ended before its file is removed.
    encoder: PipedProgram,
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

    /// The same with the sound of another film; what is missing of it is told.
    pub fn sounding_like(mut self, film: Option<&Film>, observe: &mut Observer<'_>) -> Self {
        let mut tell = |line| observe(Event::Warning(line));
        self.sound = film.and_then(|film| Sound::of(film, self.container(), &mut tell));
        self
    }

    /// Adds a photo in color; `name` is for errors.
    pub fn write_colored(&mut self, name: &str, colored: &Colored) -> Result<(), StoreError> {
        let size = [colored.width, colored.height];
        match self.started(size, colored.deep)?.deep {
            true => self.add(name, size, bytemuck::cast_slice(&colored.rgb)),
            false => self.add(name, size, &colored.bytes()),
        }
    }

    /// Adds a picture; `name` is for errors.
    ///
    /// # Errors
    /// [`StoreError::File`] where it has another size than those before, or ffmpeg fails.
    pub fn write(&mut self, name: &str, picture: &RgbImage) -> Result<(), StoreError> {
        let size = [picture.width(), picture.height()];
        self.started(size, false)?;
        self.add(name, size, picture.as_raw())
    }

    fn started(&mut self, size: [u32; 2], deep: bool) -> Result<&mut Started, StoreError> {
        let started = match self.started.take() {
            Some(started) => started,
            None => self.start(size, deep)?,
        };
        Ok(self.started.insert(started))
    }

    fn add(&mut self, name: &str, size: [u32; 2], bytes: &[u8]) -> Result<(), StoreError> {
        let Some(started) = &mut self.started else {
            return Ok(());
        };
        if started.size != size {
            let [[width, height], [w, h]] = [size, started.size];
            return Err(StoreError::file(
                &self.path,
                format!(
                    "{name} has {width} x {height} pixels, those before {w} x {h}: a film's frames have one size; write them to a folder"
                ),
            ));
        }
        let written = started.encoder.write(bytes);
        written.map_err(|error| self.failed(&error))
    }

    /// Ends the film and puts it in its place, with its sound as far as that can be had.
    ///
    /// # Errors
    /// [`StoreError::File`] where ffmpeg fails on the pictures.
    pub fn finish(mut self, observe: &mut Observer<'_>) -> Result<(), StoreError> {
        let Some(Started { encoder, draft, .. }) = self.started.take() else {
            return Ok(());
        };
        encoder.finish().map_err(|error| self.failed(&error))?;
        // The pictures are there by now, whatever becomes of the sound.
        let sounding = self.sound.as_ref().and_then(|sound| {
            let another = || disk::create(&self.path).map_err(|error| error.to_string());
            let mut tell = |line| observe(Event::Warning(line));
            sound.under(draft.path(), self.container(), &another, &mut tell)
        });
        let whole = sounding.unwrap_or(draft);
        whole.persist(&self.path).map_err(files::at(&self.path))
    }

    /// FFmpeg's name of what the film's path promises.
    fn container(&self) -> &'static str {
        let extension = self.path.extension().unwrap_or_default().to_string_lossy();
        match extension.to_ascii_lowercase().as_str() {
            "mkv" => "matroska",
            "mov" => "mov",
            _ => "mp4",
        }
    }

    fn failed(&self, error: &ProgramError) -> StoreError {
        StoreError::file(&self.path, error.to_string())
    }

    fn start(&self, [width, height]: [u32; 2], deep: bool) -> Result<Started, StoreError> {
        let draft = disk::create(&self.path).map_err(files::at(&self.path))?;
        let container = self.container();
        let mut ffmpeg = Program::new(FFMPEG)
            .args(["-hide_banner", "-nostats", "-loglevel", "error", "-y"])
            .args(["-f", "rawvideo"])
            .option("-pix_fmt", if deep { "rgb48" } else { "rgb24" })
            .option("-video_size", format!("{width}x{height}"))
            .option("-framerate", format!("{}/{}", self.rate[0], self.rate[1]))
            .args(["-i", "pipe:0"]);
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
            .args(["-color_trc", "bt709", "-color_range", "tv"]);
        let ffmpeg = in_container(ffmpeg, container).arg(draft.path());
        Ok(Started {
            encoder: ffmpeg.feed()?,
            draft,
            size: [width, height],
            deep,
        })
    }
}
