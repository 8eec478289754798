//! Queries to FFmpeg: a film's properties, its cuts, interlacing; and extraction of all frames of a
//! shot.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::{
    PrepareError,
    color_tags::ColorTags,
    scan::{Scan, scan},
    shots::{self, ShotDetector},
    signal::{ratio, signal_of},
};
use crate::{
    capture::Signal,
    programs::{self, FFMPEG, Pictures, Program, ProgramError},
};

/// The oldest that knows `-fps_mode`.
const OLDEST: [u32; 2] = [5, 1];

/// Interlacing is looked for in so many seconds of a shot at most.
const LOOKED_AT: f64 = 20.0;

/// Containers in which seeking leads to any picture; in others it loses the first ones.
const INDEXED: [&str; 6] = ["mov", "matroska", "avi", "mxf", "dv", "image2"];

/// The first picture of a stream is looked for in so many seconds.
const FIRST_WITHIN: &str = "%+15";

/// Names of frames, as FFmpeg and C write them.
const NAMES: &str = "%06d.png";

/// A film's file and what it holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FilmSource {
    /// The file, absolute; the pattern of numbered pictures' names.
    pub path: PathBuf,
    /// Numbered pictures, where the film is no file.
    pub pictures: Option<Pictures>,
    /// FFmpeg's number of the stream of pictures.
    pub(super) stream: u64,
    /// Frames a second: numerator and denominator.
    pub frame_rate: [u32; 2],
    /// The lowest rate at which all frames can be shown when they are, where FFmpeg says.
    pub(super) tick_rate: Option<[u32; 2]>,
    /// Seconds; 0 where the file does not say.
    pub seconds: f64,
    /// True if the film has sound.
    pub audio: bool,
    /// FFmpeg's name of the container, the first of several.
    pub(super) container: String,
    /// The time stamp from which times of parts count, in seconds.
    pub(super) zero: f64,
    /// By how many seconds that is later than the beginning of the file, with its sound.
    pub late: f64,
    /// Its colors and its projection.
    pub color_tags: ColorTags,
    /// Its pictures; time code and number are the first one's.
    pub(super) signal: Signal,
    /// True if the signal of lightness uses all values.
    full_range: bool,
}

/// A part of a film, in seconds; open at its end where that is the film's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Part {
    pub start: f64,
    pub seconds: Option<f64>,
}

/// Refuses an FFmpeg that is too old.
///
/// # Errors
/// [`ProgramError::Missing`] where there is none.
pub(super) fn check_version() -> Result<(), PrepareError> {
    let said = Program::new(FFMPEG).arg("-version").ask()?;
    match version(&said) {
        Some(found) if found < OLDEST => Err(PrepareError::OldFfmpeg {
            found: format!("{}.{}", found[0], found[1]),
        }),
        // Builds between releases have other names.
        _ => Ok(()),
    }
}

fn version(said: &str) -> Option<[u32; 2]> {
    let named = said
        .lines()
        .find_map(|line| line.strip_prefix("ffmpeg version "))?;
    let number = named
        .trim_start_matches('n')
        .split(|c: char| !c.is_ascii_digit());
    let mut parts = number.map(str::parse);
    Some([parts.next()?.ok()?, parts.next()?.ok()?])
}

impl FilmSource {
    /// Asks `ffprobe` what a film is.
    ///
    /// # Errors
    /// [`PrepareError`].
    pub fn probe(path: &Path, pictures: Option<Pictures>) -> Result<Self, PrepareError> {
        let said = match &pictures {
            Some(pictures) => programs::probe_pictures(pictures),
            None => programs::probe(path),
        };
        let said = said.map_err(|error| match error {
            ProgramError::Failed { said, .. } => PrepareError::at(path, match unlisted(&said) {
                Some(format) => format!(
                    "is no film by itself, but {format}, which may lead to other files; make one file of it, such as .mp4 or .mkv"
                ),
                None => format!("cannot be read as a film ({said})"),
            }),
            other => other.into(),
        })?;
        let source = Self::parse(path, &said);
        let mut source = source.map_err(|reason| PrepareError::at(path, reason))?;
        if let Some(pictures) = pictures {
            source.signal.know(&pictures);
            source.pictures = Some(pictures);
        }
        if !source.is_indexed() {
            // A recording may begin with pictures that cannot be decoded.
            let first = ["-read_intervals", FIRST_WITHIN];
            if let Some(first) = source
                .stamps(&first, "frame=best_effort_timestamp_time")?
                .first()
            {
                source.late += first - source.zero;
                source.zero = *first;
            }
        }
        Ok(source)
    }

    /// Time stamps of packets or frames by `ffprobe`, in seconds.
    ///
    /// # Errors
    /// [`ProgramError`].
    pub(super) fn stamps(&self, options: &[&str], entries: &str) -> Result<Vec<f64>, PrepareError> {
        let said = Program::new("ffprobe")
            .args(["-v", "error", "-of", "json"])
            .option("-select_streams", self.stream.to_string())
            .args(options)
            .option("-show_entries", entries);
        Ok(stamps(&self.input(said).ask()?))
    }

    /// A program with the film as its input.
    fn input(&self, program: Program) -> Program {
        match &self.pictures {
            Some(pictures) => program.pictures(pictures),
            None => program.film(&self.path),
        }
    }

    /// True if seeking can reach any frame.
    fn is_indexed(&self) -> bool {
        INDEXED.contains(&&*self.container)
    }

    fn parse(path: &Path, said: &str) -> Result<Self, String> {
        let json = json(said).ok_or("cannot be read as a film: ffprobe says nothing of it")?;
        let streams = json["streams"].as_array().map_or(&[][..], Vec::as_slice);
        // The picture of a cover is no film.
        let still = ["attached_pic", "timed_thumbnails", "still_image"];
        let is = |stream: &Value, what: &str| stream["disposition"][what] == 1;
        let moving = streams.iter().filter(|stream| {
            stream["codec_type"] == "video" && !still.iter().any(|what| is(stream, what))
        });
        let moving: Vec<&Value> = moving.collect();
        let pictures = moving.iter().find(|stream| is(stream, "default"));
        let pictures = *pictures
            .or(moving.first())
            .ok_or("holds no moving pictures")?;
        let rates = ["avg_frame_rate", "r_frame_rate"];
        let frame_rate = rates
            .into_iter()
            .find_map(|key| ratio(pictures[key].as_str()?));
        let seconds = stamp(&pictures["duration"]).or(stamp(&json["format"]["duration"]));
        let names = json["format"]["format_name"].as_str().unwrap_or_default();
        let begins = |of: &Value| stamp(&of["start_time"]);
        let begin = begins(&json["format"]).unwrap_or(0.0);
        Ok(Self {
            path: path.into(),
            pictures: None,
            stream: pictures["index"].as_u64().unwrap_or(0),
            tick_rate: pictures["r_frame_rate"].as_str().and_then(ratio),
            frame_rate: frame_rate.ok_or("does not say how many frames a second it has")?,
            seconds: seconds.filter(|s| *s > 0.0).unwrap_or(0.0),
            audio: streams.iter().any(|stream| stream["codec_type"] == "audio"),
            container: names.split(',').next().unwrap_or_default().to_owned(),
            zero: begin,
            late: 0.0,
            color_tags: ColorTags::of(pictures),
            signal: signal_of(pictures, &json),
            full_range: pictures["color_range"] == "pc",
        })
    }

    /// Frames a second.
    pub fn rate(&self) -> f64 {
        f64::from(self.frame_rate[0]) / f64::from(self.frame_rate[1])
    }

    /// FFmpeg on a part of the film with filters, up to its output.
    fn part(&self, part: Part, level: &str, filters: &[&str]) -> Program {
        let mut ffmpeg =
            Program::new(FFMPEG).args(["-hide_banner", "-nostdin", "-nostats", "-v", level]);
        let mut chain = Vec::new();
        if self.is_indexed() {
            if part.start > 0.0 {
                ffmpeg = ffmpeg.option("-ss", seconds(part.start));
            }
            if let Some(length) = part.seconds {
                ffmpeg = ffmpeg.option("-t", seconds(length));
            }
        } else {
            // All that comes before is decoded, and cut off by its time stamps.
            let start = seconds(part.start);
            let end = part.seconds.map_or(String::new(), |length| {
                format!(":end={}", seconds(part.start + length))
            });
            chain.push("setpts=PTS-STARTPTS".to_owned());
            chain.push(format!("trim=start={start}{end},setpts=PTS-{start}/TB"));
        }
        chain.extend(filters.iter().map(|&filter| filter.to_owned()));
        if self
            .path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("exr"))
        {
            // Of light, which is linear.
            ffmpeg = ffmpeg.args(["-apply_trc", "iec61966_2_1"]);
        }
        let mut ffmpeg = self
            .input(ffmpeg)
            .option("-map", format!("0:{}", self.stream));
        if !chain.is_empty() {
            ffmpeg = ffmpeg.option("-vf", chain.join(","));
        }
        ffmpeg
    }

    /// The shots of a part of the film, as ranges of seconds of the film; only the first where
    /// that is all that is wanted. Tells how many seconds it has seen.
    ///
    /// # Errors
    /// [`ProgramError`].
    pub fn shots(
        &self,
        part: Part,
        only_first: bool,
        seen: &mut dyn FnMut(f64),
    ) -> Result<Vec<[f64; 2]>, PrepareError> {
        let [width, height] = shots::SIZE;
        let [numerator, denominator] = self.frame_rate;
        let mut cutter = ShotDetector::default();
        let mut frame = vec![0; width * height];
        let tiny = format!("scale={width}:{height}:flags=area,format=gray");
        self.part(part, "error", &[&tiny])
            // So that a frame's number is its time, also where the film's rate varies.
            .option("-r", format!("{numerator}/{denominator}"))
            .args(["-fps_mode", "cfr", "-f", "rawvideo", "-"])
            .read(|from| {
                from.read_exact(&mut frame)?;
                cutter.look(&frame);
                let frames = cutter.frames();
                let now = frames % 25 == 0;
                if now {
                    seen(frames as f64 / self.rate());
                }
                Ok(!(only_first && now && cutter.has_first()))
            })?;
        let time = |frame: usize| part.start + frame as f64 / self.rate();
        let shots = cutter.shots().into_iter();
        Ok(shots
            .map(|shot| [time(shot.start), time(shot.end)])
            .collect())
    }

    /// Scan type of a part: progressive, interlaced or telecined.
    ///
    /// # Errors
    /// [`ProgramError`].
    pub fn scan(&self, part: Part) -> Result<Scan, PrepareError> {
        let length = part.seconds.unwrap_or(LOOKED_AT).min(LOOKED_AT);
        let looked_at = Part {
            seconds: Some(length),
            ..part
        };
        let said = self
            .part(looked_at, "info", &["idet"])
            .args(["-f", "null", "-"])
            .ask()?;
        Ok(scan(&said, self.rate()))
    }

    /// Writes all frames of a part into a folder, in gray, progressive, with square pixels. Tells
    /// how many there are so far.
    ///
    /// # Errors
    /// [`ProgramError`].
    pub fn extract(
        &self,
        part: Part,
        (scan, colors): (Scan, &[&str]),
        folder: &Path,
        written: &mut dyn FnMut(usize),
    ) -> Result<(), PrepareError> {
        let mut filters = scan.filters().to_vec();
        let [across, down] = self.signal.pixel_aspect;
        if across != down {
            // The side that is too short grows, so that nothing is lost.
            filters.push(
                "scale=w=if(gt(sar\\,1)\\,trunc(iw*sar+0.5)\\,iw):h=if(gt(sar\\,1)\\,ih\\,trunc(ih/sar+0.5)),setsar=1",
            );
        }
        filters.extend(colors);
        let lightness = self.signal.lightness(self.full_range);
        if colors.is_empty() {
            filters.extend(lightness.as_deref());
        }
        self.part(part, "error", &filters)
            .args(["-fps_mode", "passthrough", "-pix_fmt"])
            .arg(if self.signal.bits > 8 {
                "gray16be"
            } else {
                "gray"
            })
            .args(["-progress", "pipe:1", "-f", "image2"])
            // Below the folder, whose path may hold a %.
            .arg(NAMES)
            .run(folder, &mut |line| {
                if let Some(count) = line.strip_prefix("frame=") {
                    written(count.trim().parse().unwrap_or(0));
                }
            })?;
        Ok(())
    }
}

/// The format that FFmpeg did not open as it may lead to other files, if it says so.
fn unlisted(said: &str) -> Option<&str> {
    let (before, _) = said.split_once("] Format not on whitelist")?;
    before.rsplit('[').next()?.split(' ').next()
}

/// JSON in the output of `ffprobe`; warnings of another stream may precede it.
fn json(said: &str) -> Option<Value> {
    let json = &said[said.find('{').unwrap_or(0)..];
    serde_json::Deserializer::from_str(json)
        .into_iter()
        .next()?
        .ok()
}

/// A time that `ffprobe` tells, in seconds.
fn stamp(value: &Value) -> Option<f64> {
    let seconds = value.as_str()?.parse::<f64>().ok();
    seconds.filter(|seconds| seconds.is_finite())
}

/// The time stamps of packets that are shown, or of frames, from what `ffprobe` says.
fn stamps(said: &str) -> Vec<f64> {
    let json = json(said).unwrap_or_default();
    let all = json["packets"].as_array().or(json["frames"].as_array());
    let shown = all.into_iter().flatten().filter(|one| {
        let flags = one["flags"].as_str().unwrap_or_default();
        // What an edit list leaves out is decoded and discarded.
        !flags.contains('D')
    });
    shown
        .filter_map(|one| stamp(&one["pts_time"]).or(stamp(&one["best_effort_timestamp_time"])))
        .collect()
}

/// A time as FFmpeg reads it, to the microsecond.
fn seconds(time: f64) -> String {
    format!("{time:.6}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions() {
        for (said, expected) in [
            ("ffmpeg version 5.1.9-0+deb12u1 Copyright (c)", Some([5, 1])),
            ("ffmpeg version n7.0 Copyright", Some([7, 0])),
            ("ffmpeg version 4.4.2-0ubuntu0.22.04.1", Some([4, 4])),
            ("ffmpeg version N-118193-g5f38c82536", None),
            ("something else", None),
        ] {
            assert_eq!(version(said), expected, "{said}");
        }
    }

    const PROBED: &str = r#"[mov @ 0x1] a warning
{
  "streams": [
    {"index": 0, "codec_type": "audio"},
    {"index": 1, "codec_type": "video", "disposition": {"attached_pic": 1}},
    {"index": 2, "codec_type": "video", "pix_fmt": "yuv420p10le",
     "sample_aspect_ratio": "16:15", "avg_frame_rate": "0/0", "r_frame_rate": "24000/1001",
     "field_order": "tt", "color_transfer": "unknown", "disposition": {"attached_pic": 0}},
    {"index": 3, "codec_type": "data", "tags": {"timecode": "01:00:00:00"}}
  ],
  "format": {"duration": "12.500000", "format_name": "matroska,webm", "start_time": "-0.5"}
}
and another"#;

    #[test]
    fn a_film_is_read() {
        let path = Path::new("/films/a.mkv");
        let film = FilmSource::parse(path, PROBED).unwrap();
        let expected = FilmSource {
            path: path.into(),
            pictures: None,
            stream: 2,
            frame_rate: [24000, 1001],
            tick_rate: Some([24000, 1001]),
            seconds: 12.5,
            audio: true,
            container: "matroska".to_owned(),
            zero: -0.5,
            late: 0.0,
            color_tags: ColorTags::of(&Value::Null),
            signal: Signal {
                bits: 10,
                pixel_format: "yuv420p10le".to_owned(),
                transfer: None,
                dpx_transfer: None,
                field_order: Some("tt".to_owned()),
                pixel_aspect: [16, 15],
                timecode: Some("01:00:00:00".to_owned()),
                names: None,
                first: 0,
            },
            full_range: false,
        };
        assert_eq!(film, expected);
        for (said, word) in [
            (
                r#"{"streams": [{"codec_type": "audio"}]}"#,
                "no moving pictures",
            ),
            (
                r#"{"streams": [{"codec_type": "video"}]}"#,
                "frames a second",
            ),
            ("", "nothing"),
        ] {
            let error = FilmSource::parse(path, said).unwrap_err();
            assert!(error.contains(word), "{error}");
        }
    }

    #[test]
    fn shown_packets_have_stamps() {
        let said = r#"a warning
{"packets": [{"pts_time": "1.500"}, {"pts_time": "1.000"}, {}, {"pts_time": "N/A"},
  {"pts_time": "0.900", "flags": "KD_"}]}"#;
        assert_eq!(stamps(said), [1.5, 1.0]);
        let frames = r#"{"frames": [{"best_effort_timestamp_time": "1.5"}]}"#;
        assert_eq!(stamps(frames), [1.5]);
        assert!(stamps("nothing").is_empty());
    }
}
