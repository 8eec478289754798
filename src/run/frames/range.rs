//! The range of the pictures of photos of more than 8 bits.

use super::shots::Shot;
use crate::{
    capture::{CaptureError, Dataset, Film, Normalize, in_order},
    tell::{Event, Observer, Stage},
};

/// Values that become black and white in pictures: the file's own, or, if the scene's photos are
/// normalized because they use little of the range, the minimum and maximum over all photos, so
/// that nothing is clipped and nothing flickers. A film's frames stay as they are.
pub(super) fn own_range(
    dataset: &Dataset,
    film: Option<&Film>,
    shots: &[Shot],
    observe: &mut Observer<'_>,
) -> Normalize {
    let loader = dataset.loader();
    let (Normalize::Range(scene), None) = (loader.options().normalize, film) else {
        return Normalize::Off;
    };
    observe(Event::begins(Stage::Survey));
    let [mut black, mut white] = [f64::INFINITY, f64::NEG_INFINITY];
    let _: Result<(), CaptureError> = in_order(
        shots,
        |shot| loader.extremes(&shot.path),
        |_, extremes| {
            // What cannot be read is told where it is to be colored.
            if let Ok(Some([low, high])) = extremes {
                [black, white] = [black.min(low), white.max(high)];
            }
            Ok(())
        },
    );
    if black >= white {
        return Normalize::Off;
    }
    observe(Event::Note(format!(
        "the pictures go from {black:.6} (black) to {white:.6} (white), so that nothing is clipped; the scene from {:.6} to {:.6}",
        scene[0], scene[1]
    )));
    Normalize::Range([black, white])
}
