//! A film of pictures, by ffmpeg.

mod join;
mod sound;

use std::path::{Path, PathBuf};

use image::RgbImage;
use sound::{Sound, in_container};

pub(crate) use join::Piece;

use super::{
    codec::{Codec, Pixels, extension},
    files,
};
use crate::{
    archive::Timecode,
    capture::Film,
    disk::{self, Draft},
    frames::Colored,
    programs::{FFMPEG, PipedProgram, Program, ProgramError},
    store::StoreError,
    tell::{Event, Observer},
};

/// Frames a second where nobody says: film's.
pub(crate) const FRAME_RATE: [u32; 2] = [24, 1];

/// Chroma finer than lightness calls for: color is what was made here. With it the frames of an old
/// film differ by a tenth less in a and b, for 4 % more bytes.
const CHROMA: &str = "chroma-qp-offset=-6";

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
    codec: Codec,
    /// Bits of a channel of the source, where photos have more than 8.
    bits: u32,
    timecode: Option<Timecode>,
    sound: Option<Sound>,
    started: Option<Started>,
}

struct Started {
    // Ended before its file is removed.
    encoder: PipedProgram,
    /// Until it is in its place.
    draft: Draft,
    size: [u32; 2],
    pixels: Pixels,
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
            codec: Codec::H264,
            bits: 16,
            timecode: None,
            sound: None,
            started: None,
        })
    }

    /// The same in another codec, with the time code of its first frame.
    pub fn coded(mut self, codec: Codec, timecode: Option<Timecode>) -> Self {
        (self.codec, self.timecode) = (codec, timecode);
        self
    }

    /// The same with the depth and sound of another film; what is missing of it is told.
    pub fn like(mut self, film: Option<&Film>, observe: &mut Observer<'_>) -> Self {
        let mut tell = |line| observe(Event::Warning(line));
        let signal = film.and_then(|film| film.signal.as_ref());
        self.bits = signal.map_or(16, |signal| signal.bits);
        let archival = self.codec != Codec::H264;
        self.sound = film.and_then(|film| Sound::of(film, self.container(), archival, &mut tell));
        self
    }

    /// Adds a photo in color; `name` is for errors.
    pub fn write_colored(&mut self, name: &str, colored: &Colored) -> Result<(), StoreError> {
        let size = [colored.width, colored.height];
        let bits = if colored.deep { self.bits.max(9) } else { 8 };
        let pixels = self.started(size, self.codec.pixels(bits))?.pixels;
        self.add(name, size, &pixels.bytes(&colored.rgb))
    }

    /// Adds a picture; `name` is for errors.
    ///
    /// # Errors
    /// [`StoreError::File`] where it has another size than those before, or ffmpeg fails.
    pub fn write(&mut self, name: &str, picture: &RgbImage) -> Result<(), StoreError> {
        let size = [picture.width(), picture.height()];
        self.started(size, Pixels::Bytes)?;
        self.add(name, size, picture.as_raw())
    }

    fn started(&mut self, size: [u32; 2], pixels: Pixels) -> Result<&mut Started, StoreError> {
        let started = match self.started.take() {
            Some(started) => started,
            None => self.start(size, pixels)?,
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
        match &*extension(&self.path) {
            "mkv" => "matroska",
            "mov" => "mov",
            "mxf" => "mxf",
            _ => "mp4",
        }
    }

    fn failed(&self, error: &ProgramError) -> StoreError {
        StoreError::file(&self.path, error.to_string())
    }

    fn start(&self, size: [u32; 2], pixels: Pixels) -> Result<Started, StoreError> {
        let draft = disk::create(&self.path).map_err(files::at(&self.path))?;
        let [width, height] = size;
        let mut ffmpeg = Program::new(FFMPEG)
            .args(["-hide_banner", "-nostats", "-loglevel", "error", "-y"])
            .args(["-f", "rawvideo"])
            .option("-pix_fmt", pixels.name())
            .option("-video_size", format!("{width}x{height}"))
            .option("-framerate", format!("{}/{}", self.rate[0], self.rate[1]))
            .args(["-i", "pipe:0"]);
        ffmpeg = match self.codec {
            Codec::Ffv1 => lossless(ffmpeg, pixels),
            Codec::Prores => mezzanine(ffmpeg, "yuv422p10", &PRORES, "hq"),
            Codec::Prores4444 => mezzanine(ffmpeg, "yuv444p10", &PRORES, "4444"),
            Codec::Dnxhr => mezzanine(ffmpeg, "yuv422p10", &DNXHR, "dnxhr_hqx"),
            _ => self.h264(ffmpeg, size),
        };
        ffmpeg = ffmpeg.args(["-color_primaries", "bt709", "-color_trc", "bt709"]);
        if let Some(timecode) = self.timecode {
            ffmpeg = ffmpeg.option("-timecode", timecode.to_string());
        }
        let ffmpeg = in_container(ffmpeg, self.container()).arg(draft.path());
        Ok(Started {
            encoder: ffmpeg.feed()?,
            draft,
            size,
            pixels,
        })
    }

    fn h264(&self, ffmpeg: Program, [width, height]: [u32; 2]) -> Program {
        // Chroma at half size needs even sides.
        let odd = width % 2 + height % 2 > 0;
        let (pad, pixels) = match (odd, self.purpose) {
            (false, _) => ("", "yuv420p"),
            (true, Purpose::Editing) => ("", "yuv444p"),
            (true, Purpose::Viewing) => ("pad=ceil(iw/2)*2:ceil(ih/2)*2,", "yuv420p"),
        };
        let filters = format!("{pad}scale=in_range=full:out_range=limited:out_color_matrix=bt709");
        ffmpeg
            .args(["-c:v", "libx264", "-crf", self.purpose.quality()])
            .args(["-pix_fmt", pixels, "-x264-params", CHROMA])
            .option("-vf", filters)
            .args(["-colorspace", "bt709", "-color_range", "tv"])
    }
}

/// Encoders of ProRes and DNxHR, and what tells editors who made it.
const PRORES: [&str; 4] = ["-c:v", "prores_ks", "-vendor", "apl0"];
const DNXHR: [&str; 2] = ["-c:v", "dnxhd"];

/// FFV1 as archives keep it: version 3, each frame by itself, with checksums.
fn lossless(ffmpeg: Program, pixels: Pixels) -> Program {
    let format = match pixels {
        Pixels::Rgb(10) => "gbrp10",
        Pixels::Rgb(12) => "gbrp12",
        Pixels::Rgb(_) => "gbrp16",
        _ => "bgr0",
    };
    ffmpeg
        .args([
            "-c:v",
            "ffv1",
            "-level",
            "3",
            "-g",
            "1",
            "-slices",
            "4",
            "-slicecrc",
            "1",
        ])
        .args([
            "-pix_fmt",
            format,
            "-colorspace",
            "rgb",
            "-color_range",
            "pc",
        ])
}

/// A codec for editing, in 10 bits.
fn mezzanine(ffmpeg: Program, format: &str, encoder: &[&str], profile: &str) -> Program {
    ffmpeg
        // What comes is limited already: lightness stays as it is.
        .option(
            "-vf",
            "setparams=range=tv:colorspace=bt709:field_mode=prog,setsar=1",
        )
        .args(encoder.iter().copied())
        .args(["-profile:v", profile, "-pix_fmt", format])
        .args(["-colorspace", "bt709", "-color_range", "tv"])
}
