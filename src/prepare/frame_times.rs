//! When the frames of a film are shown, where they do not follow each other at one rate.

use serde_json::Value;

use super::{
    PrepareError,
    ffmpeg::{Part, Source},
};
use crate::programs::Program;

/// Frames a second of a film whose rate varies, at most.
const FASTEST: f64 = 120.0;

/// By how many frames a film may run ahead of an even rate, or behind it, and be of that rate:
/// containers round times.
const UNEVEN: f64 = 0.75;

/// Frames that do not follow each other at one rate.
pub(super) struct Uneven {
    /// When each is shown, in seconds of the film.
    pub times: Vec<f64>,
    /// A rate at which they can be repeated to be shown so, as a fraction.
    pub rate: [u32; 2],
}

impl Source {
    /// When the frames of a part are shown where these vary; `None` where they follow each other
    /// at the frame rate, or are not as many as `count`.
    ///
    /// # Errors
    /// [`ProgramError`].
    pub fn times(&self, part: Part, count: usize) -> Result<Option<Uneven>, PrepareError> {
        let said = Program::new("ffprobe")
            .args(["-v", "error", "-of", "json"])
            .option("-select_streams", self.stream.to_string())
            .args(["-show_entries", "packet=pts_time:format=start_time"])
            .film(&self.path)
            .ask()?;
        let end = part.seconds.map_or(f64::INFINITY, |s| part.start + s);
        let mut times = packet_times(&said);
        times.retain(|time| (part.start..end).contains(time));
        let varies = times.len() == count && varies(&times, self.rate());
        Ok(varies.then(|| {
            let fast = self.tick_rate.filter(|rate| {
                let rate = f64::from(rate[0]) / f64::from(rate[1]);
                (self.rate()..=FASTEST).contains(&rate)
            });
            Uneven {
                times,
                rate: fast.unwrap_or([FASTEST as u32, 1]),
            }
        }))
    }
}

/// When packets are shown, in order, in seconds from the film's beginning, from what `ffprobe`
/// says.
fn packet_times(said: &str) -> Vec<f64> {
    let json = &said[said.find('{').unwrap_or(0)..];
    let json = serde_json::Deserializer::from_str(json).into_iter::<Value>();
    let json = json.flatten().next().unwrap_or_default();
    let seconds = |value: &Value| {
        value
            .as_str()?
            .parse::<f64>()
            .ok()
            .filter(|s| s.is_finite())
    };
    let start = seconds(&json["format"]["start_time"]).unwrap_or(0.0);
    let packets = json["packets"].as_array().into_iter().flatten();
    let times = packets.filter_map(|packet| Some(seconds(&packet["pts_time"])? - start));
    let mut times: Vec<f64> = times.collect();
    times.sort_by(f64::total_cmp);
    times
}

/// Whether frames are not shown at an even rate.
fn varies(times: &[f64], rate: f64) -> bool {
    let uneven = |(k, time): (usize, &f64)| {
        let even = times[0] + k as f64 / rate;
        (time - even).abs() * rate > UNEVEN
    };
    times.iter().enumerate().any(uneven)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_that_vary() {
        let even: Vec<f64> = (0..100)
            .map(|k| 3.0 + (f64::from(k) / 24.0 * 1e3).round() / 1e3)
            .collect();
        assert!(!varies(&even, 24.0) && !varies(&[], 24.0));
        // Twice as fast from the middle on.
        let fast: Vec<f64> = (0..100)
            .map(|k: u32| f64::from(k) - 0.5 * f64::from(k.saturating_sub(50)))
            .collect();
        assert!(varies(&fast, 99.0 / 74.5));
        let said = r#"a warning
{"packets": [{"pts_time": "1.500"}, {"pts_time": "1.000"}, {}, {"pts_time": "N/A"}],
 "format": {"start_time": "1.000"}}"#;
        assert_eq!(packet_times(said), [0.0, 0.5]);
        assert!(packet_times("nothing").is_empty());
    }
}
