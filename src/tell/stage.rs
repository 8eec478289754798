//! The parts of a command that take time.

use std::fmt;

/// A part of a run that takes time. Each second of a run belongs to one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Opening the device.
    Device,
    /// Reading COLMAP's model, headers of photos and splat files.
    Model,
    /// Dividing a scene into blocks.
    Dividing,
    /// Looking at the range of the photos' values.
    Survey,
    /// Timing the device, where time is limited.
    Pace,
    /// Reading photos.
    Photos,
    /// Finding out which effects they need.
    Plan,
    /// Short trainings that tell whether the scene calls for an effect.
    Trial,
    /// Placing the first Gaussians, and all that a training needs on the device.
    Placing,
    /// Stage 1.
    Training,
    /// Asking the teacher.
    Teacher,
    /// Solving for the lightness of other photos.
    Relight,
    /// Listing the Gaussians of each view's tiles.
    Lists,
    /// Solving for chroma harmonics of one degree after the other.
    Degree,
    /// Stage 2.
    Solving,
    /// Comparing how strong colors are with the teacher's.
    Strength,
    /// From a/b to the RGB that splat files have.
    Bake,
    /// Coloring a scene in another way, to compare with.
    Baseline,
    /// Finding Gaussians that no training view needs.
    Cleaning,
    /// Fitting the scene to a viewer.
    Viewer,
    /// Drawing pictures.
    Rendering,
    /// Following strokes from photo to photo.
    Strokes,
    /// Coloring photos at full size.
    Coloring,
    /// Measuring pictures against photos.
    Measuring,
    /// Drawing and comparing the frames of a path.
    Path,
    /// Drawing the photographed views.
    Views,
    /// Comparing these with each other.
    Pairs,
    /// Writing a page and its pictures.
    Page,
    /// Writing files.
    Saving,
    /// Whole runs, one after the other; counted in seconds.
    Sweep,
    /// Looking for a film's cuts; counted in seconds of the film.
    Cuts,
    /// Writing a film's frames.
    Frames,
    /// Looking for a film's sharpest frames.
    Sharpness,
    /// Making masks.
    Masks,
    /// Looking for features.
    Features,
    /// Matching photos.
    Matches,
    /// Finding poses.
    Poses,
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&format!("{self:?}").to_lowercase())
    }
}
