//! Detection of a film's cuts from tiny frames, robust to flicker.

use std::{collections::VecDeque, ops::Range};

/// Width and height at which frames are compared: grain and small things that move are gone.
pub(super) const SIZE: [usize; 2] = [64, 36];

/// Frames whose gray deviates less from its mean, in levels of 255, show nothing: black, or
/// white between two shots.
const EMPTY: f32 = 2.5;

/// Two frames of one shot differ by less, as 1 less their correlation: a hand-held camera that
/// turns stays below 0.1 at this size, and frames of two shots have little in common.
const CUT: f32 = 0.15;

/// And frames at a cut differ by so many times as much as those around it usually do, so that a
/// camera that sweeps across is not cut into pieces.
const STANDS_OUT: f32 = 5.0;

/// Frames that have next to nothing in common, and by how many times they then stand out: where
/// frames jump, none can differ five times as much.
const NOTHING_IN_COMMON: [f32; 2] = [0.6, 2.0];

/// Rank of the usual difference among those around, smallest first: where frames are shown twice
/// or three times most of these are zero.
const USUAL: f32 = 0.8;

/// So many frames to either side are around a cut.
const AROUND: usize = 12;

/// A frame less its mean, of length 1; none where it shows nothing.
type Shape = Option<Vec<f32>>;

/// Looks at frame after frame. How bright a frame is and how strong its contrast do not matter:
/// old films flicker.
#[derive(Default)]
pub(super) struct ShotDetector {
    /// The last three frames.
    last: VecDeque<Shape>,
    /// Difference of the frames on either side of each boundary: before frame 1, 2, ….
    differences: Vec<f32>,
    /// True for each frame that shows nothing.
    empty: Vec<bool>,
}

impl ShotDetector {
    /// Takes the next frame, `[height, width]` of [`SIZE`].
    pub fn look(&mut self, frame: &[u8]) {
        let shape = shape(frame);
        self.empty.push(shape.is_none());
        self.last.push_back(shape);
        if self.last.len() > 4 {
            self.last.pop_front();
        }
        // The boundary before the last frame but one, now that the frame behind it is known.
        if self.last.len() > 2 {
            self.judge(self.last.len() - 2);
        }
    }

    /// Number of frames seen.
    pub fn frames(&self) -> usize {
        self.empty.len()
    }

    /// Returns true if the first shot has ended in a cut or an empty frame.
    pub fn has_first(&self) -> bool {
        let begun = self.empty.iter().position(|empty| !empty);
        let settled = self.frames().saturating_sub(AROUND + 2);
        begun.is_some_and(|begun| {
            shots(&self.differences, &self.empty)
                .first()
                .is_some_and(|first| begun < settled && first.end < settled)
        })
    }

    /// The shots: ranges of frames.
    pub fn shots(mut self) -> Vec<Range<usize>> {
        if self.last.len() > 1 {
            self.judge(self.last.len() - 1);
        }
        shots(&self.differences, &self.empty)
    }

    /// Records the boundary before frame `at`: the least difference of up to four pairs of frames
    /// around it, so that a single white, torn or missing frame is no cut.
    fn judge(&mut self, at: usize) {
        let before = self.last.range(at.saturating_sub(2)..at);
        let after: Vec<_> = self.last.range(at..).take(2).collect();
        let pairs = before.flat_map(|a| after.iter().map(move |b| difference(a, b)));
        self.differences.push(pairs.fold(f32::INFINITY, f32::min));
    }
}

fn shape(frame: &[u8]) -> Shape {
    let count = frame.len().max(1) as f32;
    let mean = frame.iter().map(|&v| f32::from(v)).sum::<f32>() / count;
    let mut shape: Vec<f32> = frame.iter().map(|&v| f32::from(v) - mean).collect();
    let length = shape.iter().map(|v| v * v).sum::<f32>().sqrt();
    if length < EMPTY * count.sqrt() {
        return None;
    }
    shape.iter_mut().for_each(|v| *v /= length);
    Some(shape)
}

fn difference(a: &Shape, b: &Shape) -> f32 {
    match (a, b) {
        (Some(a), Some(b)) => 1.0 - a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>(),
        (None, None) => 0.0,
        _ => 1.0,
    }
}

/// Ranges of frames between cuts, without the empty frames at their ends.
fn shots(differences: &[f32], empty: &[bool]) -> Vec<Range<usize>> {
    let cuts = (0..differences.len()).filter(|&at| is_cut(differences, empty, at));
    let ends = cuts.map(|at| at + 1).chain([empty.len()]);
    let mut shots = Vec::new();
    let mut start = 0;
    for end in ends {
        let mut shown = start..end;
        while shown.start < shown.end && empty[shown.start] {
            shown.start += 1;
        }
        while shown.start < shown.end && empty[shown.end - 1] {
            shown.end -= 1;
        }
        if !shown.is_empty() {
            shots.push(shown);
        }
        start = end;
    }
    shots
}

/// Returns true if there is a cut after frame `at`.
fn is_cut(differences: &[f32], empty: &[bool], at: usize) -> bool {
    // How empty frames differ says nothing of how the camera moves.
    let shows = |at: usize| !(empty[at] || empty[at + 1]);
    let around = at.saturating_sub(AROUND)..differences.len().min(at + AROUND + 1);
    let others = around.filter(|&other| other != at && shows(other));
    let mut others: Vec<f32> = others.map(|other| differences[other]).collect();
    others.sort_by(f32::total_cmp);
    let rank = (USUAL * others.len() as f32) as usize;
    let usual = others.get(rank).copied().unwrap_or(0.0);
    let [unlike, stands_out] = NOTHING_IN_COMMON;
    let found = differences[at];
    let is_alone = found > STANDS_OUT * usual || (found > unlike && found > stands_out * usual);
    found > CUT && (!shows(at) || is_alone)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of a pattern of its own for each `scene`, moved to the left.
    fn frame(scene: usize, moved: usize, gain: f32) -> Vec<u8> {
        let [width, height] = SIZE;
        let wave = |x: usize, y: usize| {
            let (x, y) = ((x + moved) as f32, y as f32);
            let turn = 0.7 * scene as f32;
            (0.11 * (x * turn.cos() + y * turn.sin()) + scene as f32).sin()
        };
        (0..width * height)
            .map(|p| (gain * (128.0 + 90.0 * wave(p % width, p / width))).clamp(0.0, 255.0) as u8)
            .collect()
    }

    fn shots_of(frames: impl IntoIterator<Item = Vec<u8>>) -> Vec<[usize; 2]> {
        let mut cutter = ShotDetector::default();
        frames.into_iter().for_each(|frame| cutter.look(&frame));
        let shots = cutter.shots().into_iter();
        shots.map(|shot| [shot.start, shot.end]).collect()
    }

    #[test]
    fn cuts_are_where_scenes_change() {
        let lengths = [20, 3, 40];
        let frames = (0..3).flat_map(|scene| (0..lengths[scene]).map(move |n| (scene, n)));
        let found = shots_of(frames.map(|(scene, n)| frame(scene, n, 1.0)));
        assert_eq!(found, [[0, 20], [20, 23], [23, 63]]);
    }

    #[test]
    fn flicker_a_flash_and_motion_are_no_cuts() {
        let flicker = (0..50).map(|n| frame(1, 2 * n, 0.6 + 0.4 * ((n * 7) % 5) as f32 / 5.0));
        assert_eq!(shots_of(flicker), [[0, 50]]);
        let flash = (0..50).map(|n| match n {
            25 => vec![250; SIZE[0] * SIZE[1]],
            _ => frame(2, n, 1.0),
        });
        assert_eq!(shots_of(flash), [[0, 50]]);
        let torn = (0..50).map(|n| frame(if n == 25 { 4 } else { 2 }, n, 1.0));
        assert_eq!(shots_of(torn), [[0, 50]]);
    }

    #[test]
    fn held_and_jumping_frames_are_cut_where_the_scene_changes() {
        let held = (0..60).map(|n| frame(2 * usize::from(n >= 30), 6 * (n / 3), 1.0));
        assert_eq!(shots_of(held), [[0, 30], [30, 60]]);
        // Every frame differs by more than a cut's least.
        let jumping: Vec<_> = (0..40)
            .map(|n| frame(2 * usize::from(n >= 20), 8 * n, 1.0))
            .collect();
        let usual = difference(&shape(&jumping[0]), &shape(&jumping[1]));
        assert!((CUT..0.5).contains(&usual), "{usual}");
        assert_eq!(shots_of(jumping), [[0, 20], [20, 40]]);
    }

    #[test]
    fn black_is_no_part_of_a_shot() {
        let black = || vec![vec![3; SIZE[0] * SIZE[1]]; 6];
        let scene = |scene| (0..20).map(move |n| frame(scene, n, 1.0));
        let film = black().into_iter().chain(scene(0)).chain(black());
        let found = shots_of(film.chain(scene(0)).chain(black()));
        assert_eq!(found, [[6, 26], [32, 52]]);
        assert_eq!(shots_of(black()), [[0; 2]; 0]);
        assert_eq!(shots_of([]), [[0; 2]; 0]);
        assert_eq!(shots_of([frame(0, 0, 1.0)]), [[0, 1]]);
        assert_eq!(shots_of([frame(0, 0, 1.0), frame(0, 1, 1.0)]), [[0, 2]]);
    }

    #[test]
    fn the_first_shot_is_known_early() {
        let mut cutter = ShotDetector::default();
        for n in 0..60 {
            cutter.look(&frame(usize::from(n >= 30), n, 1.0));
            assert_eq!(cutter.has_first(), n >= 30 + AROUND + 2, "{n}");
        }
    }
}
