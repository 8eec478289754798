//! Detection of interlaced and telecined films, and filters that make them progressive.

/// Share of frames with a repeated field above which 30 fps video is telecined 24 fps film; 3:2
/// pulldown repeats a field in two of five frames.
const REPEATED: f64 = 0.2;

/// Video of 30 (29.97) frames a second, which film of 24 may have become.
const VIDEO_RATE: [f64; 2] = [29.5, 30.5];

/// Scan type of a shot's frames; each has the filters that make them progressive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scan {
    /// The frames are progressive already.
    Progressive,
    /// Each frame holds fields of two moments.
    Interlaced,
    /// Every four frames of film became five of video.
    Telecined,
}

impl Scan {
    /// FFmpeg's filters.
    pub fn filters(self) -> &'static [&'static str] {
        match self {
            Self::Progressive => &[],
            Self::Interlaced => &["bwdif=send_frame"],
            Self::Telecined => &["fieldmatch", "decimate"],
        }
    }

    /// The frame rate that is left.
    pub fn rate(self, [numerator, denominator]: [u32; 2]) -> [u32; 2] {
        match self {
            Self::Telecined => reduced([4 * u64::from(numerator), 5 * u64::from(denominator)]),
            _ => [numerator, denominator],
        }
    }
}

/// Scan type by the output of FFmpeg's `idet`; `rate` in frames per second.
pub(super) fn scan(said: &str, rate: f64) -> Scan {
    let counts = |title: &str, names: [&str; 3]| -> [f64; 3] {
        let line = said.lines().rev().find(|line| line.contains(title));
        names.map(|name| {
            let rest = line
                .and_then(|line| line.rsplit_once(name))
                .map(|(_, rest)| rest);
            let number = rest.and_then(|rest| rest.split_whitespace().next());
            number.and_then(|number| number.parse().ok()).unwrap_or(0.0)
        })
    };
    let [neither, top, bottom] = counts("Repeated Fields:", ["Neither:", "Top:", "Bottom:"]);
    let [upper, lower, progressive] =
        counts("Multi frame detection:", ["TFF:", "BFF:", "Progressive:"]);
    let frames = (neither + top + bottom).max(1.0);
    // Where fields are of one moment, noise passes for either order as often.
    let interlaced = (upper - lower).abs();
    if (VIDEO_RATE[0]..VIDEO_RATE[1]).contains(&rate)
        && (top + bottom) / frames > REPEATED
        && interlaced > 0.0
    {
        Scan::Telecined
    } else if interlaced > progressive {
        Scan::Interlaced
    } else {
        Scan::Progressive
    }
}

/// A ratio in its lowest terms.
fn reduced(ratio: [u64; 2]) -> [u32; 2] {
    let [mut a, mut b] = ratio;
    while b != 0 {
        (a, b) = (b, a % b);
    }
    ratio.map(|part| u32::try_from(part / a.max(1)).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn idet(repeated: [u32; 3], multi: [u32; 3]) -> String {
        format!(
            "[Parsed_idet_0 @ 0x1] Repeated Fields: Neither: {:6} Top: {:6} Bottom: {:6}\n\
             [Parsed_idet_0 @ 0x1] Single frame detection: TFF: 9 BFF: 9 Progressive: 9 Undetermined: 9\n\
             [Parsed_idet_0 @ 0x1] Multi frame detection: TFF: {:6} BFF: {:6} Progressive: {:6} Undetermined: 3\n",
            repeated[0], repeated[1], repeated[2], multi[0], multi[1], multi[2],
        )
    }

    #[test]
    fn interlacing() {
        let film = 29.97;
        assert_eq!(
            scan(&idet([500, 0, 0], [0, 0, 480]), 25.0),
            Scan::Progressive
        );
        assert_eq!(
            scan(&idet([500, 3, 2], [400, 0, 40]), 25.0),
            Scan::Interlaced
        );
        assert_eq!(
            scan(&idet([500, 3, 2], [0, 400, 40]), film),
            Scan::Interlaced
        );
        assert_eq!(
            scan(&idet([300, 100, 100], [180, 0, 300]), film),
            Scan::Telecined
        );
        assert_eq!(
            scan(&idet([300, 100, 100], [180, 0, 300]), 25.0),
            Scan::Progressive
        );
        assert_eq!(
            scan(&idet([100, 0, 0], [47, 44, 9]), 25.0),
            Scan::Progressive
        );
        assert_eq!(scan("", film), Scan::Progressive);
        assert_eq!(Scan::Telecined.rate([30000, 1001]), [24000, 1001]);
        assert_eq!(Scan::Interlaced.rate([25, 1]), [25, 1]);
    }
}
