//! The sound of the film that pictures come from, laid under the pictures in color.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::{
    capture::Film,
    disk::Draft,
    programs::{self, FFMPEG, Program},
};

/// Codecs that players expect beside H.264 in MP4 and QuickTime files.
const IN_MP4: &str = "aac alac mp3 ac3 eac3";

/// Those that Matroska has as well.
const IN_MATROSKA: &str = "flac opus vorbis mp2 dts truehd";

/// Codecs without loss: written anew they are the same, and begin and end to the sample.
const LOSSLESS: &str =
    "alac flac pcm_s16le pcm_s24le pcm_s32le pcm_f32le pcm_s16be pcm_s24be pcm_s32be";

/// Filter for sound that begins where the pictures do, with silence where there is none yet.
const IN_STEP: &str = "aresample=async=1:first_pts=0";

/// Sound that begins within this of the pictures, in seconds, does so with them: a codec's packet.
const PACKET: f64 = 0.05;

/// A film that is shorter than its shot by more, in seconds, is another.
const SLACK: f64 = 1.0;

/// The sound of a shot.
pub(crate) struct Sound {
    source: PathBuf,
    /// When the shot begins, in seconds from the beginning of its film.
    start: f64,
    /// Duration, in seconds.
    seconds: f64,
    streams: Vec<Stream>,
}

/// A stream of sound.
struct Stream {
    /// FFmpeg's number of it.
    index: u64,
    codec: String,
    /// Codecs for writing it, the best first.
    ways: Vec<AudioCodec>,
}

/// Codec and filters for writing a stream.
struct AudioCodec {
    /// FFmpeg's name of the codec, or `copy`.
    codec: String,
    /// FFmpeg's filters, if any.
    filters: String,
    /// Loss in the sound, for a message; empty if there is none.
    lost: String,
}

impl Sound {
    /// Sound of a film, for a container by FFmpeg's name; `None` if it has none. What cannot be
    /// copied becomes AAC, or with `archival` PCM. `tell` receives a message about anything missing.
    pub fn of(
        film: &Film,
        container: &str,
        archival: bool,
        tell: &mut dyn FnMut(String),
    ) -> Option<Self> {
        if !film.audio {
            return None;
        }
        let name = film.source.display();
        let said = programs::probe(&film.source).unwrap_or_default();
        let probed: Value = serde_json::from_str(&said).unwrap_or_default();
        let all = probed["streams"].as_array().map_or(&[][..], Vec::as_slice);
        let of = |kind: &'static str| all.iter().filter(move |s| s["codec_type"] == kind);
        if of("audio").next().is_none() {
            let why = match (film.source.is_file(), all.is_empty()) {
                (false, _) => "is gone",
                (true, true) => "cannot be read by ffprobe",
                (true, false) => "has no sound any more",
            };
            tell(format!(
                "{name} {why}: the film in color is silent; put the film back there and run frames again"
            ));
            return None;
        }
        let number = |value: &Value| value.as_str()?.parse::<f64>().ok();
        let duration = number(&probed["format"]["duration"]).unwrap_or(f64::INFINITY);
        // Square pixels are made by stretching one side; a turned film has the other's.
        let has = |stream: &Value, side: u32| stream["width"] == side || stream["height"] == side;
        let sized = of("video").any(|stream| film.size.iter().any(|&side| has(stream, side)));
        if film.start + film.seconds > duration + SLACK || !sized {
            tell(format!(
                "{name} has changed since it was prepared: its sound may be of something else"
            ));
        }
        let begin = number(&probed["format"]["start_time"]).unwrap_or(0.0) + film.start;
        let mut streams = Vec::new();
        for stream in of("audio") {
            let index = stream["index"].as_u64().unwrap_or(0);
            let codec = stream["codec_name"].as_str().unwrap_or("none");
            if ["none", "unknown"].contains(&codec) {
                let tag = stream["codec_tag_string"].as_str().unwrap_or(codec);
                tell(format!(
                    "{name}: stream {index} of sound ({tag}) is left out: FFmpeg cannot decode it"
                ));
                continue;
            }
            let late = number(&stream["start_time"]).unwrap_or(begin) - begin;
            // Packets are cut where they end, which is not where the pictures do.
            let together = film.start < 1e-3 && late.abs() < PACKET;
            let channels = stream["channels"].as_u64().unwrap_or(0);
            streams.push(Stream {
                index,
                codec: codec.to_owned(),
                ways: ways(codec, channels, together, container, archival),
            });
        }
        (!streams.is_empty()).then(|| Self {
            source: film.source.clone(),
            start: film.start,
            seconds: film.seconds,
            streams,
        })
    }

    /// A film without sound once more, with it; none where no stream can be had. `draft` makes a
    /// file for it, and `tell` hears what is lost.
    pub fn under(
        &self,
        pictures: &Path,
        container: &str,
        draft: &dyn Fn() -> Result<Draft, String>,
        tell: &mut dyn FnMut(String),
    ) -> Option<Draft> {
        let join = |chosen: &[(&Stream, &AudioCodec)]| {
            let draft = draft()?;
            let ffmpeg = self.joining(pictures, container, chosen);
            let done = ffmpeg.arg(draft.path()).ask();
            done.map(|_| draft).map_err(|error| error.to_string())
        };
        let best = self.streams.iter().map(|stream| (stream, &stream.ways[0]));
        if let Ok(joined) = join(&best.collect::<Vec<_>>()) {
            let changed = self
                .streams
                .iter()
                .filter(|stream| !stream.ways[0].lost.is_empty());
            changed.for_each(|stream| tell(self.line(stream, &stream.ways[0].lost)));
            return Some(joined);
        }
        // One after the other, to find out which it is.
        let mut chosen = Vec::new();
        for stream in &self.streams {
            let mut lost = String::new();
            let found = stream
                .ways
                .iter()
                .find(|way| match join(&[(stream, *way)]) {
                    Ok(_) => {
                        lost.clone_from(&way.lost);
                        true
                    }
                    Err(reason) => {
                        lost = format!("is left out: {reason}");
                        false
                    }
                });
            if !lost.is_empty() {
                tell(self.line(stream, &lost));
            }
            chosen.extend(found.map(|way| (stream, way)));
        }
        if chosen.is_empty() {
            return None;
        }
        let joined = join(&chosen);
        joined
            .map_err(|reason| tell(format!("the film in color is silent: {reason}")))
            .ok()
    }

    /// A message about a stream.
    fn line(&self, Stream { index, codec, .. }: &Stream, lost: &str) -> String {
        let source = self.source.display();
        format!("{source}: stream {index} of sound ({codec}) {lost}")
    }

    /// FFmpeg, up to its output.
    fn joining(
        &self,
        pictures: &Path,
        container: &str,
        chosen: &[(&Stream, &AudioCodec)],
    ) -> Program {
        let mut ffmpeg = Program::new(FFMPEG)
            .args([
                "-hide_banner",
                "-nostdin",
                "-nostats",
                "-loglevel",
                "error",
                "-y",
            ])
            .film(pictures);
        // Counts from the container's first time stamp, as the shot's start does.
        if self.start > 0.0 {
            ffmpeg = ffmpeg.option("-ss", format!("{:.6}", self.start));
        }
        ffmpeg = ffmpeg
            .option("-t", format!("{:.6}", self.seconds))
            .film(&self.source)
            .args([
                "-map",
                "0:v",
                "-c:v",
                "copy",
                "-map_chapters",
                "-1",
                "-b:a",
                "256k",
            ]);
        for (k, (stream, way)) in chosen.iter().enumerate() {
            ffmpeg = ffmpeg
                .option("-map", format!("1:{}", stream.index))
                .option(&format!("-c:a:{k}"), &way.codec);
            if !way.filters.is_empty() {
                ffmpeg = ffmpeg.option(&format!("-filter:a:{k}"), &way.filters);
            }
        }
        in_container(ffmpeg, container)
    }
}

/// Codecs for writing a stream with this many channels, the best first; `together` is true if it
/// begins with the pictures.
fn ways(
    codec: &str,
    channels: u64,
    together: bool,
    container: &str,
    archival: bool,
) -> Vec<AudioCodec> {
    let way = |codec: &str, filters: &str, lost: &str| AudioCodec {
        codec: codec.to_owned(),
        filters: filters.to_owned(),
        lost: lost.to_owned(),
    };
    let among = |codecs: &str| codecs.split(' ').any(|known| known == codec);
    let mut ways = Vec::new();
    if container == "mxf" {
        // Nothing else but PCM, of 48 kHz.
        let kept = if codec == "pcm_s16le" {
            codec
        } else {
            "pcm_s24le"
        };
        let lost = match codec == kept {
            true => "",
            false => "becomes PCM of 24 bits and 48 kHz",
        };
        ways.push(way(kept, &format!("aresample=48000,{IN_STEP}"), lost));
        return ways;
    }
    let taken = among(IN_MP4)
        || (container == "matroska" && among(IN_MATROSKA))
        || (container != "mp4" && codec.starts_with("pcm_"));
    if taken && together && archival {
        ways.push(way("copy", "", ""));
    }
    if taken && among(LOSSLESS) {
        ways.push(way(codec, IN_STEP, ""));
    }
    if taken && together && !archival {
        ways.push(way("copy", "", ""));
    }
    if archival {
        let cut = "becomes PCM of 24 bits, cut where the pictures begin and end";
        ways.push(way("pcm_s24le", IN_STEP, cut));
    }
    ways.push(way("aac", IN_STEP, ""));
    if channels > 2 {
        // The last also of channels of which nobody says where they are.
        let all: Vec<String> = (0..channels).map(|channel| format!("c{channel}")).collect();
        for (filter, left) in [
            ("aformat=channel_layouts=stereo".to_owned(), "two channels"),
            (format!("pan=mono|c0<{}", all.join("+")), "one channel"),
        ] {
            let lost = format!("has {left} instead of {channels}");
            ways.push(way("aac", &format!("{filter},{IN_STEP}"), &lost));
        }
    }
    ways
}

/// FFmpeg with a container for its output.
pub(super) fn in_container(mut ffmpeg: Program, container: &str) -> Program {
    ffmpeg = match container {
        "matroska" => ffmpeg,
        // Any frame rate.
        "mxf" => ffmpeg.args(["-strict", "unofficial"]),
        // A page shows it before all of it is there.
        _ => ffmpeg.args(["-movflags", "+faststart"]),
    };
    ffmpeg.args(["-f", container])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sound_is_kept_as_it_is_where_the_container_has_it_and_it_begins_with_the_pictures() {
        let codecs = |codec: &str, channels, together, container: &str| {
            let ways = ways(codec, channels, together, container, false);
            ways.into_iter().map(|way| way.codec).collect::<Vec<_>>()
        };
        assert_eq!(codecs("aac", 2, true, "mp4"), ["copy", "aac"]);
        assert_eq!(codecs("aac", 2, false, "mp4"), ["aac"]);
        assert_eq!(codecs("opus", 2, true, "mp4"), ["aac"]);
        assert_eq!(codecs("opus", 2, true, "matroska"), ["copy", "aac"]);
        assert_eq!(codecs("pcm_s24le", 2, false, "mov"), ["pcm_s24le", "aac"]);
        assert_eq!(codecs("pcm_s24le", 2, true, "mp4"), ["aac"]);
        assert_eq!(codecs("pcm_bluray", 6, false, "mov"), ["aac"; 3]);
        let archival = |codec, container| ways(codec, 2, true, container, true).remove(0).codec;
        assert_eq!(archival("pcm_s16le", "mov"), "copy");
        assert_eq!(archival("opus", "mov"), "pcm_s24le");
        assert_eq!(archival("aac", "mxf"), "pcm_s24le");
        let last = ways("pcm_s16le", 3, true, "mp4", false)
            .pop()
            .expect("a way");
        assert!(
            last.filters.starts_with("pan=mono|c0<c0+c1+c2,"),
            "{}",
            last.filters
        );
        assert_eq!(last.lost, "has one channel instead of 3");
    }
}
