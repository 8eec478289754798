//! Time codes (SMPTE ST 12-1): numbers of frames as `HH:MM:SS:FF`.

use std::fmt;

/// Time code of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Timecode {
    /// Frames since midnight.
    number: u64,
    /// Frames that a second counts.
    fps: u64,
    /// Numbers left out each minute but every tenth: 2 or 4 in drop-frame time codes, else 0.
    dropped: u64,
}

impl Timecode {
    /// `HH:MM:SS:FF`, or `HH:MM:SS;FF` where numbers are dropped, in a film of so many frames a
    /// second, a fraction.
    pub fn parse(text: &str, rate: [u32; 2]) -> Option<Self> {
        let fps = nominal(rate);
        let drops = text.contains([';', '.']) && rate[1] == 1001 && fps.is_multiple_of(30);
        let dropped = if drops { fps / 15 } else { 0 };
        let parts: Vec<u64> = (text.split([':', ';', '.']).map(str::parse))
            .collect::<Result<_, _>>()
            .ok()?;
        let &[hours @ 0..24, minutes @ 0..60, seconds @ 0..60, frames] = &parts[..] else {
            return None;
        };
        let minutes = 60 * hours + minutes;
        let number = (60 * minutes + seconds) * fps + frames;
        (frames < fps).then(|| Self {
            number: number - dropped * (minutes - minutes / 10),
            fps,
            dropped,
        })
    }

    /// The time code of a later frame.
    pub fn after(self, frames: u64) -> Self {
        let number = self.number + frames;
        Self { number, ..self }
    }

    /// The time code at another rate: at the same rate the same, else without drops.
    pub fn at_rate(self, rate: [u32; 2]) -> Self {
        let fps = nominal(rate);
        match fps == self.fps {
            true => self,
            false => Self {
                number: self.number * fps / self.fps,
                fps,
                dropped: 0,
            },
        }
    }

    /// Hours, minutes, seconds and frames.
    fn parts(self) -> [u64; 4] {
        let Self {
            mut number,
            fps,
            dropped,
        } = self;
        if dropped > 0 {
            let ten_minutes = 600 * fps - 9 * dropped;
            let (tens, rest) = (number / ten_minutes, number % ten_minutes);
            let minutes = rest.saturating_sub(dropped) / (60 * fps - dropped);
            number += dropped * (9 * tens + minutes);
        }
        let seconds = number / fps;
        [
            seconds / 3600 % 24,
            seconds / 60 % 60,
            seconds % 60,
            number % fps,
        ]
    }

    /// Two decimal digits a byte, hours in the highest.
    pub fn digits(self) -> u32 {
        let byte = |part: u64| (part / 10 % 10 * 16 + part % 10) as u32;
        self.parts().iter().fold(0, |all, &p| all << 8 | byte(p))
    }
}

/// Text of the digits of [`Timecode::digits`]; flags in their highest bits are left out.
pub(super) fn text(digits: u32) -> String {
    let [hours, minutes, seconds, frames] = digits.to_be_bytes();
    format!(
        "{:02x}:{:02x}:{:02x}:{:02x}",
        hours & 0x3f,
        minutes & 0x7f,
        seconds & 0x7f,
        frames & 0x3f
    )
}

/// Frames that a second of time code counts.
fn nominal([frames, seconds]: [u32; 2]) -> u64 {
    ((f64::from(frames) / f64::from(seconds)).round() as u64).max(1)
}

impl fmt::Display for Timecode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [hours, minutes, seconds, frames] = self.parts();
        let mark = if self.dropped > 0 { ';' } else { ':' };
        write!(f, "{hours:02}:{minutes:02}:{seconds:02}{mark}{frames:02}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_counted_at_any_rate() {
        for (from, rate, frames, to) in [
            ("01:00:00:15", [16, 1], 1, "01:00:01:00"),
            ("00:59:59:23", [24000, 1001], 1, "01:00:00:00"),
            ("23:59:59:17", [18, 1], 1, "00:00:00:00"),
            ("10:00:00:00", [25, 1], 90_000, "11:00:00:00"),
            // Numbers 0 and 1 are dropped, but not in minutes 0, 10, 20 …
            ("00:00:59;29", [30000, 1001], 1, "00:01:00;02"),
            ("00:09:59;29", [30000, 1001], 1, "00:10:00;00"),
            ("00:00:00;00", [30000, 1001], 107_892, "01:00:00;00"),
            ("00:00:59;59", [60000, 1001], 1, "00:01:00;04"),
            // Where none can be dropped none are.
            ("00:00:59;24", [25, 1], 1, "00:01:00:00"),
        ] {
            let code = Timecode::parse(from, rate).expect(from);
            assert_eq!(code.after(frames).to_string(), to, "{from}");
        }
        for wrong in ["", "1:2:3", "24:00:00:00", "00:00:00:24", "a:b:c:d"] {
            assert_eq!(Timecode::parse(wrong, [24, 1]), None, "{wrong}");
        }
    }

    #[test]
    fn digits_and_other_rates() {
        let code = Timecode::parse("10:20:30:12", [24, 1]).expect("a time code");
        assert_eq!(code.digits(), 0x1020_3012);
        assert_eq!(text(0x1020_3012 | 0x40), "10:20:30:12");
        assert_eq!(code.at_rate([16, 1]).to_string(), "10:20:30:08");
        assert_eq!(code.at_rate([24000, 1001]), code);
    }
}
