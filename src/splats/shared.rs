//! Parts that all formats of splat files share.

use std::path::Path;

use glam::DVec3;

use super::{SplatError, Splats, sh::coefficient_count};

/// Colors in a file.
pub(super) const CHANNELS: usize = 3;

/// Norm below which a quaternion has no direction.
pub(super) const MIN_QUATERNION_NORM: f64 = 1e-12;

/// The share of the Gaussians that a format may spoil without a word.
const TOLD: f64 = 0.01;

/// Bytes of memory that Gaussians may take however small their file is, and for each byte of a
/// compressed one: a file that announces more is cut off, or made to fill the memory.
const MEMORY: [usize; 2] = [8 << 20, 56];

/// Content of a splat file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadSplats {
    /// The Gaussians, with an RGB field. Quaternions are as in the file, not
    /// necessarily of unit length.
    pub splats: Splats,
    /// Gaussians that were left out because a number was not finite or the
    /// quaternion zero. An infinite opacity is not counted: it is opaque or transparent; nor is
    /// a scale of minus infinity: it is flat.
    pub skipped: usize,
    /// Offset subtracted from the centers, in world units, by the file
    /// ([`offset_comment`](super::ply::offset_comment) in a `.ply`); zero without one.
    pub offset: DVec3,
    /// Bytes behind all that the header announces: its count is likely too small.
    pub surplus: u64,
    /// True if the file marks the Gaussians as trained antialiased
    /// ([`ANTIALIASED`](super::ply::ANTIALIASED), or Postshot's `antialiased 1`, in a `.ply`).
    pub antialiased: bool,
    /// Conversions applied on reading, a line each.
    pub notes: Vec<String>,
    /// Warnings about content of the file that is not read, a line each.
    pub doubts: Vec<String>,
}

/// Options of writing a splat file, and metadata for its header.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WriteOptions {
    /// The program that writes, as files name it.
    pub generator: String,
    /// True if the Gaussians were trained antialiased.
    pub antialiased: bool,
    /// Added to the centers in f64 before they are rounded, in world units.
    pub added: DVec3,
    /// Offset subtracted from the centers, noted in the file, in world units.
    pub offset: DVec3,
}

pub(super) fn norm(quaternion: &[f32; 4]) -> f64 {
    let squares = quaternion.iter().map(|&q| f64::from(q).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Finds out what a format does to the Gaussians that it is given.
pub(super) struct FormatFidelity<'a> {
    pub path: &'a Path,
    pub splats: &'a Splats,
    pub doubts: Vec<String>,
}

impl FormatFidelity<'_> {
    /// Judges a format whose numbers are `steps` apart at a center, in world units: a Gaussian
    /// whose middle scale is below that would be moved by half its size or more.
    ///
    /// # Errors
    /// [`SplatError::Coarse`] where that happens to most of them.
    pub fn steps(&mut self, steps: impl Fn([f32; 3]) -> f64) -> Result<(), SplatError> {
        let count = self.splats.len();
        let shapes = self.splats.means.iter().zip(&self.splats.log_scales);
        let smaller = |(mean, scales): &(&[f32; 3], &[f32; 3])| {
            f64::from(middle(**scales)).exp() < steps(**mean)
        };
        let moved = shapes.filter(smaller).count();
        if 2 * moved > count {
            return Err(SplatError::Coarse {
                path: self.path.to_owned(),
                moved,
                count,
            });
        }
        self.tell(moved, "are moved by up to half their size or more");
        Ok(())
    }

    /// Judges log-scales that are clipped to a range. What is thin does not matter beside what
    /// is long.
    pub fn log_scales(&mut self, [low, high]: [f32; 2]) {
        let longest = |scales: &[f32; 3]| scales.iter().copied().fold(f32::MIN, f32::max);
        // A tenth of the longest.
        let matters = |scales: &&[f32; 3]| {
            longest(scales) > high
                || longest(scales) - std::f32::consts::LN_10 < low
                    && scales.iter().any(|&scale| scale < low)
        };
        let clipped = self.splats.log_scales.iter().filter(matters).count();
        self.tell(clipped, "have scales beyond its range, which are clipped");
    }

    /// Judges harmonics that are clipped to a range: of degree 0, or those above.
    pub fn harmonics(&mut self, constant: bool, [low, high]: [f32; 2]) {
        let field = &self.splats.sh;
        let beyond = |index: &usize| {
            let all = field.of(*index);
            let (zero, rest) = all.split_at(CHANNELS);
            let some = if constant { zero } else { rest };
            some.iter().any(|&value| value < low || value > high)
        };
        let clipped = (0..self.splats.len()).filter(beyond).count();
        let what = match constant {
            true => "have colors beyond its range, which are clipped",
            false => "have harmonics beyond its range, which are clipped",
        };
        self.tell(clipped, what);
    }

    fn tell(&mut self, some: usize, what: &str) {
        if some as f64 > TOLD * self.splats.len() as f64 {
            self.doubts.push(format!(
                "{}: {some} of {} Gaussians {what}; a .ply keeps them, and a .compressed.ply most of it",
                self.path.display(),
                self.splats.len()
            ));
        }
    }
}

/// The second of three log-scales.
pub(super) fn middle(mut scales: [f32; 3]) -> f32 {
    scales.sort_unstable_by(f32::total_cmp);
    scales[1]
}

/// Bytes of memory that a Gaussian with harmonics of a degree takes.
pub(super) fn memory(degree: u32) -> usize {
    size_of::<f32>() * (11 + CHANNELS * coefficient_count(degree))
}

/// Refuses a count of Gaussians that take `each` bytes to read, which a compressed file of so many
/// bytes cannot hold.
pub(super) fn check_count(
    path: &Path,
    count: usize,
    each: usize,
    bytes: usize,
) -> Result<(), SplatError> {
    let [least, more] = MEMORY;
    let most = least.saturating_add(more.saturating_mul(bytes));
    match count.saturating_mul(each) > most {
        true => Err(SplatError::damaged(
            path,
            "count",
            format!("{count} Gaussians are more than {bytes} bytes hold; it is cut off or damaged"),
        )),
        false => Ok(()),
    }
}

/// Gaussians as they are read, one after the other.
pub(super) struct SplatBuilder {
    read: ReadSplats,
}

impl SplatBuilder {
    /// For so many, with harmonics of a degree.
    pub fn new(count: usize, degree: u32) -> Self {
        Self {
            read: ReadSplats {
                splats: Splats::with_capacity(count, degree, CHANNELS),
                ..ReadSplats::default()
            },
        }
    }

    /// Takes a Gaussian, unless a number of it is not finite or its quaternion is zero. `sh` is
    /// `[(degree + 1)², 3]`.
    pub fn push(
        &mut self,
        mean: [f32; 3],
        quaternion: [f32; 4],
        log_scales: [f32; 3],
        opacity_logit: f32,
        sh: &[f32],
    ) {
        let all = [&mean[..], &quaternion, &log_scales, &[opacity_logit], sh];
        let finite = |values: &&[f32]| values.iter().all(|value| value.is_finite());
        if !all.iter().all(finite) || norm(&quaternion) < MIN_QUATERNION_NORM {
            self.read.skipped += 1;
            return;
        }
        let splats = &mut self.read.splats;
        splats.means.push(mean);
        splats.quats.push(quaternion);
        splats.log_scales.push(log_scales);
        splats.opacity_logits.push(opacity_logit);
        splats.sh.coefficients.extend(sh);
    }

    /// The scene as read.
    pub fn finish(self) -> ReadSplats {
        self.read
    }
}
