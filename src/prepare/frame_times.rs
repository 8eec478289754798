//! When the frames of a film are shown, where they do not follow each other at one rate.

use super::{
    PrepareError,
    ffmpeg::{FilmSource, Part},
};

/// Frames a second of a film whose rate varies, at most.
const FASTEST: f64 = 120.0;

/// By how many frames a film may run ahead of an even rate, or behind it, and be of that rate:
/// containers round times.
const UNEVEN: f64 = 0.75;

impl FilmSource {
    /// When the frames of a part are shown, in seconds from the film's zero, in order: from its
    /// packets where these are `count`, else from what the decoder makes of them.
    ///
    /// # Errors
    /// [`ProgramError`].
    pub fn times(&self, part: Part, count: usize) -> Result<Vec<f64>, PrepareError> {
        let end = part.seconds.map_or(f64::INFINITY, |s| part.start + s);
        let of_part = |stamps: Vec<f64>, zero: f64| {
            // To the microsecond, as they are told.
            let times = stamps
                .iter()
                .map(|stamp| ((stamp - zero) * 1e6).round() / 1e6);
            let mut times: Vec<f64> = times
                .filter(|time| (part.start..end).contains(time))
                .collect();
            times.sort_by(f64::total_cmp);
            times
        };
        let until = match part.seconds {
            // Frames are not stored in the order in which they are shown.
            Some(_) => format!("%{:.3}", self.zero + end + 5.0),
            None => "%".to_owned(),
        };
        let within = ["-read_intervals", &until];
        let packets = self.stamps(&within, "packet=pts_time,flags")?;
        let packets = of_part(packets, self.zero);
        if packets.len() == count {
            return Ok(packets);
        }
        let frames = self.stamps(&within, "frame=best_effort_timestamp_time")?;
        // AVI knows no such time: FFmpeg counts from where it begins to decode.
        let zero = match (&*self.container, frames.first()) {
            ("avi", Some(first)) => *first,
            _ => self.zero,
        };
        Ok(of_part(frames, zero))
    }

    /// A rate at which frames shown at these times can be repeated to be shown so, as a
    /// fraction; `None` where they follow each other at the frame rate.
    pub fn uneven(&self, times: &[f64]) -> Option<[u32; 2]> {
        let fast = self.tick_rate.filter(|rate| {
            let rate = f64::from(rate[0]) / f64::from(rate[1]);
            (self.rate()..=FASTEST).contains(&rate)
        });
        varies(times, self.rate()).then(|| fast.unwrap_or([FASTEST as u32, 1]))
    }
}

/// Returns true if the frame rate varies.
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
    }
}
