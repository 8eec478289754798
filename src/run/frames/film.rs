//! A film of colored photos, by ffmpeg.

use std::{
    io::{self, Read, Write},
    path::{Path, PathBuf},
    process::{Child, ChildStdin, Command, Stdio},
    thread::JoinHandle,
};

use crate::{
    capture::Film,
    disk::{self, Draft},
    frames::Colored,
    run::{RunError, files},
};

/// The program.
const FFMPEG: &str = "ffmpeg";

/// Frames a second where nobody says: film's.
const FRAME_RATE: [u32; 2] = [24, 1];

/// Constant rate factor of H.264: hardly to be told from the pictures.
const QUALITY: &str = "14";

/// Chroma finer than lightness calls for: color is what was made here. With it the frames of an old
/// film differ by a tenth less in a and b, for 4 % more bytes.
const CHROMA: &str = "chroma-qp-offset=-6";

/// Writes a film frame by frame.
pub(super) struct FilmWriter {
    path: PathBuf,
    rate: [u32; 2],
    /// The film that sound is taken from, where it begins and how long it is, in seconds.
    sound: Option<(PathBuf, f64, f64)>,
    started: Option<Encoder>,
}

struct Encoder {
    child: Child,
    frames: Option<ChildStdin>,
    told: Option<JoinHandle<Vec<u8>>>,
    /// Until it is in its place.
    draft: Option<Draft>,
    size: [u32; 2],
    deep: bool,
}

impl FilmWriter {
    /// A film at `path`, at the rate and with the sound of the film that the photos come from.
    ///
    /// # Errors
    /// [`RunError::NoProgram`] where ffmpeg is not there.
    pub fn new(path: &Path, film: Option<&Film>, rate: Option<[u32; 2]>) -> Result<Self, RunError> {
        let quiet = Stdio::null;
        let mut asked = Command::new(FFMPEG);
        asked
            .arg("-version")
            .stdin(quiet())
            .stdout(quiet())
            .stderr(quiet());
        if !asked.status().is_ok_and(|status| status.success()) {
            return Err(RunError::NoProgram(FFMPEG));
        }
        let sounding = film.filter(|film| film.audio && film.source.is_file());
        Ok(Self {
            path: path.to_owned(),
            rate: rate
                .or(film.map(|film| film.frame_rate))
                .unwrap_or(FRAME_RATE),
            sound: sounding.map(|film| (film.source.clone(), film.start, film.seconds)),
            started: None,
        })
    }

    /// Adds a frame; `name` is for errors.
    ///
    /// # Errors
    /// [`RunError::File`] where it has another size than those before, or ffmpeg fails.
    pub fn write(&mut self, name: &str, colored: &Colored) -> Result<(), RunError> {
        let size = [colored.width, colored.height];
        let encoder = match &mut self.started {
            Some(encoder) => encoder,
            None => {
                let encoder = self
                    .start(size, colored.deep)
                    .map_err(files::at(&self.path))?;
                self.started.insert(encoder)
            }
        };
        if encoder.size != size {
            let [[width, height], [w, h]] = [size, encoder.size];
            return Err(RunError::File {
                path: self.path.clone(),
                reason: format!(
                    "{name} has {width} x {height} pixels, those before {w} x {h}: a film's frames have one size; write them to a folder"
                ),
            });
        }
        let written = match (&mut encoder.frames, encoder.deep) {
            (Some(frames), true) => frames.write_all(bytemuck::cast_slice(&colored.rgb)),
            (Some(frames), false) => frames.write_all(&colored.bytes()),
            (None, _) => Err(io::ErrorKind::BrokenPipe.into()),
        };
        match written {
            Ok(()) => Ok(()),
            // It has ended, and says why.
            Err(error) => Err(self
                .failed()
                .unwrap_or_else(|| files::at(&self.path)(error))),
        }
    }

    /// Ends the film and puts it in its place.
    ///
    /// # Errors
    /// [`RunError::File`] where ffmpeg fails.
    pub fn finish(mut self) -> Result<(), RunError> {
        if let Some(encoder) = &mut self.started {
            drop(encoder.frames.take());
        }
        if let Some(error) = self.failed() {
            return Err(error);
        }
        let draft = self
            .started
            .as_mut()
            .and_then(|encoder| encoder.draft.take());
        draft.map_or(Ok(()), |draft| {
            draft.persist(&self.path).map_err(files::at(&self.path))
        })
    }

    /// Waits for ffmpeg to end; what it says, if it has failed.
    fn failed(&mut self) -> Option<RunError> {
        let encoder = self.started.as_mut()?;
        drop(encoder.frames.take());
        let told = encoder.told.take().and_then(|told| told.join().ok());
        let status = encoder.child.wait();
        if status.as_ref().is_ok_and(std::process::ExitStatus::success) {
            return None;
        }
        let told = String::from_utf8_lossy(&told.unwrap_or_default()).into_owned();
        let last = told.lines().rfind(|line| !line.trim().is_empty());
        Some(RunError::File {
            path: self.path.clone(),
            reason: format!("{FFMPEG} failed: {}", last.unwrap_or("it says nothing")),
        })
    }

    fn start(&self, [width, height]: [u32; 2], deep: bool) -> io::Result<Encoder> {
        let draft = disk::create(&self.path)?;
        let extension = self.path.extension().unwrap_or_default().to_string_lossy();
        let container = match extension.to_ascii_lowercase().as_str() {
            "mkv" => "matroska",
            "mov" => "mov",
            _ => "mp4",
        };
        let mut command = Command::new(FFMPEG);
        command
            .args(["-hide_banner", "-nostats", "-loglevel", "error", "-y"])
            .args([
                "-f",
                "rawvideo",
                "-pix_fmt",
                if deep { "rgb48" } else { "rgb24" },
            ])
            .arg("-video_size")
            .arg(format!("{width}x{height}"))
            .arg("-framerate")
            .arg(format!("{}/{}", self.rate[0], self.rate[1]))
            .args(["-i", "pipe:0"]);
        if let Some((source, start, seconds)) = &self.sound {
            command
                .arg("-ss")
                .arg(start.to_string())
                .arg("-t")
                .arg(seconds.to_string())
                .arg("-i")
                .arg(source)
                .args(["-map", "0:v", "-map", "1:a?", "-c:a", "aac", "-b:a", "256k"]);
        }
        // Chroma at half size needs even sides.
        let pixels = match (width % 2, height % 2) {
            (0, 0) => "yuv420p",
            _ => "yuv444p",
        };
        command
            .args([
                "-c:v",
                "libx264",
                "-crf",
                QUALITY,
                "-pix_fmt",
                pixels,
                "-x264-params",
                CHROMA,
            ])
            .args([
                "-vf",
                "scale=in_range=full:out_range=limited:out_color_matrix=bt709",
            ])
            .args([
                "-colorspace",
                "bt709",
                "-color_primaries",
                "bt709",
                "-color_trc",
                "bt709",
            ])
            .args(["-f", container])
            .arg(draft.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let mut child = command.spawn()?;
        let errors = child.stderr.take();
        let told = errors.map(|mut errors| {
            std::thread::spawn(move || {
                let mut told = Vec::new();
                // What cannot be read is not told.
                let _ = errors.read_to_end(&mut told);
                told
            })
        });
        Ok(Encoder {
            frames: child.stdin.take(),
            child,
            told,
            draft: Some(draft),
            size: [width, height],
            deep,
        })
    }
}

impl Drop for Encoder {
    fn drop(&mut self) {
        // Where it has ended there is nothing to stop.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
