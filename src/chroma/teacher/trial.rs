//! Trial of a network without a contract: candidates are tried, and their answers rated.

use super::guess::GuessedProfile;
use super::images::Filter;
use super::model::Fit;
use super::network::{Loaded, NetworkTeacher, Numbers};
use super::plausible::{beyond_colors, is_unit, lightness};
use super::profile::{ImageKind, Layout, OutputKind, Profile, Resize};
use super::{GrayImage, TeacherError, TeacherSettings};
use crate::color::srgb_to_lab;
use serde::Serialize;

/// An answer whose a and b spread by less over a photo says the same of everything, which
/// counts as being so far off, as does one near to gray.
const LEAST_SPREAD: f64 = 0.5;
const FLAT: f64 = 50.0;

/// Further off than this is as far off as can be.
const MOST: f64 = 100.0;

/// Candidates for a and b that differ by less than this do equally well, and the likelier one is
/// taken.
const NEAR: f64 = 0.5;

/// RGB outside its range by the whole of it counts as being so far off.
const OUTSIDE: f64 = 100.0;

/// Side at which networks that leave it open are tried: what most are trained at.
const SIDE: u32 = 256;

/// Divisor of open sides: networks halve their input five times at most.
const MULTIPLE: u32 = 32;

/// A candidate that was tried.
#[derive(Clone, Debug, Serialize)]
pub struct Trial {
    /// Supposed encoding of the photo's and the answer's numbers.
    pub candidate: String,
    /// Distance of the answers from plausible ones, in CIELAB units, 100 at most: of RGB, lightness
    /// against the photo's; of a and b, colors that do not exist at the photo's lightness.
    pub off: f64,
}

/// Candidate encoding of a photo.
struct Input {
    name: &'static str,
    image: ImageKind,
    range: [f32; 2],
    mean: [f32; 3],
    std: [f32; 3],
}

impl Input {
    const fn new(name: &'static str, image: ImageKind, range: [f32; 2]) -> Self {
        Self {
            name,
            image,
            range,
            mean: [0.0; 3],
            std: [1.0; 3],
        }
    }
}

/// Candidate encodings of a photo of three channels, the likeliest first. The last is scaled by
/// mean and deviation of ImageNet's photos.
const OF_THREE: &[Input] = &[
    Input::new("gray 0 to 1", ImageKind::GrayRgb, [0.0, 1.0]),
    Input::new("gray 0 to 255", ImageKind::GrayRgb, [0.0, 255.0]),
    Input::new("gray -1 to 1", ImageKind::GrayRgb, [-1.0, 1.0]),
    Input {
        mean: [0.485, 0.456, 0.406],
        std: [0.229, 0.224, 0.225],
        ..Input::new("gray as of ImageNet", ImageKind::GrayRgb, [0.0, 1.0])
    },
];

/// Candidate encodings of a photo of one channel, the likeliest first.
const OF_ONE: &[Input] = &[
    Input::new("L* 0 to 100", ImageKind::Lightness, [0.0, 100.0]),
    Input::new("L* -50 to 50", ImageKind::Lightness, [-50.0, 50.0]),
    Input::new("gray 0 to 1", ImageKind::Gray, [0.0, 1.0]),
    Input::new("L* -1 to 1", ImageKind::Lightness, [-1.0, 1.0]),
    Input::new("gray 0 to 255", ImageKind::Gray, [0.0, 255.0]),
    Input::new("gray -1 to 1", ImageKind::Gray, [-1.0, 1.0]),
];

/// Candidate encodings of RGB.
const RGB: &[(&str, [f32; 2])] = &[
    ("RGB 0 to 1", [0.0, 1.0]),
    ("RGB 0 to 255", [0.0, 255.0]),
    ("RGB -1 to 1", [-1.0, 1.0]),
];

/// Candidate encodings of a and b.
const AB: &[(&str, [f32; 2])] = &[
    ("a, b", [-110.0, 110.0]),
    ("a, b / 110", [-1.0, 1.0]),
    ("a, b 0 to 1", [0.0, 1.0]),
    ("a, b + 128", [18.0, 238.0]),
];

/// Tries what a model may take and give on photos; the candidate whose answers make most sense
/// comes back as a teacher, with all that were tried.
///
/// # Errors
/// Those of [`Loaded::contract`] where the model has no picture in or out, and what the network
/// says where it answers no candidate.
pub(super) fn guess(
    mut loaded: Loaded,
    settings: &TeacherSettings,
    photos: &[(&str, GrayImage<'_>)],
) -> Result<(NetworkTeacher, Vec<Trial>), TeacherError> {
    let layouts = [Layout::Nchw, Layout::Nhwc].into_iter();
    let mut guesses = layouts.filter_map(|layout| Some((layout, loaded.ports.guess(layout)?)));
    let Some((layout, guess)) = guesses.next() else {
        return Err(loaded.ports.unknown(&loaded.path));
    };
    let inputs = match guess.image {
        3 => OF_THREE,
        _ => OF_ONE,
    };
    let (mut trials, mut refused) = (Vec::new(), None);
    let mut best: Option<(f64, Profile, Fit)> = None;
    for input in inputs {
        // Bytes hold nothing but bytes.
        if guess.bytes && input.range != [0.0, 255.0] {
            continue;
        }
        let mut profile = candidate(&guess, layout, input);
        let Some(fit) = loaded.ports.fit(&profile) else {
            continue;
        };
        let mut teacher =
            NetworkTeacher::following(loaded, profile.clone(), fit.clone(), settings)?;
        let answers: Result<Vec<_>, _> = (photos.iter())
            .map(|(name, photo)| teacher.look(name, photo))
            .collect();
        loaded = teacher.loaded;
        let answers = match answers {
            Ok(answers) => answers,
            Err(error) => {
                refused.get_or_insert(error);
                continue;
            }
        };
        let (ranges, near) = match profile.output {
            OutputKind::Rgb => (RGB, 0.0),
            OutputKind::Ab => (AB, NEAR),
        };
        for (words, range) in ranges {
            profile.output_range = *range;
            profile.name = format!("{} in, {words} out", input.name);
            let of_each = answers.iter().zip(photos);
            let off = of_each.map(|(numbers, (_, photo))| off(&profile, numbers, photo));
            let off = off.fold(0.0, f64::max);
            let candidate = profile.name.clone();
            trials.push(Trial { candidate, off });
            if best.as_ref().is_none_or(|(least, ..)| off < least - near) {
                best = Some((off, profile.clone(), fit.clone()));
            }
        }
    }
    match (best, refused) {
        (Some((_, profile, fit)), _) => {
            let teacher = NetworkTeacher::following(loaded, profile, fit, settings)?;
            Ok((teacher, trials))
        }
        (None, Some(error)) => Err(error),
        (None, None) => Err(loaded.ports.unknown(&loaded.path)),
    }
}

/// Profile of a candidate for a network.
fn candidate(guess: &GuessedProfile, layout: Layout, input: &Input) -> Profile {
    let output = match guess.answer {
        2 => OutputKind::Ab,
        _ => OutputKind::Rgb,
    };
    Profile {
        name: input.name.to_owned(),
        inputs: guess.inputs.clone(),
        image: input.image,
        input_range: input.range,
        mean: input.mean[..guess.image].to_vec(),
        std: input.std[..guess.image].to_vec(),
        size: SIDE,
        size_multiple: guess.multiple(MULTIPLE),
        resize: Resize::Stretch,
        filter: Filter::Average,
        layout,
        answer: guess.name.clone(),
        output,
        output_range: [0.0, 1.0],
        hint_range: None,
        noise_std: None,
        class: None,
    }
}

/// Distance of an answer from plausible ones; see [`Trial::off`].
fn off(profile: &Profile, numbers: &Numbers, photo: &GrayImage<'_>) -> f64 {
    let pixels = numbers.size[0] as usize * numbers.size[1] as usize;
    let channels = profile.output.channels();
    let at = |c: usize, i: usize| numbers.values[profile.layout.index(c, i, [channels, pixels])];
    let mean = |of: &dyn Fn(usize) -> f64| (0..pixels).map(of).sum::<f64>() / pixels as f64;
    let lightness = lightness(photo, numbers.size);
    let off = match profile.output {
        OutputKind::Rgb => {
            let [black, white] = profile.output_range;
            let outside = |value: f32| {
                let share = f64::from((value - black) / (white - black));
                (share - share.clamp(0.0, 1.0)).abs()
            };
            mean(&|i| {
                let rgb = [0, 1, 2].map(|c| at(c, i));
                let [own, ..] = srgb_to_lab(rgb.map(|value| profile.rgb(value).into()));
                let beyond = rgb.into_iter().map(outside).fold(0.0, f64::max);
                (own - lightness[i]).abs() + OUTSIDE * beyond
            })
        }
        OutputKind::Ab => {
            let ab = |c: usize, i: usize| f64::from(profile.ab(at(c, i)));
            let middle = [0, 1].map(|c| mean(&|i| ab(c, i)));
            let spread = mean(&|i| {
                let from = [0, 1].map(|c| ab(c, i) - middle[c]);
                from[0] * from[0] + from[1] * from[1]
            });
            let mut all = (0..pixels).flat_map(|i| [0, 1].map(|c| profile.ab(at(c, i))));
            let flat = match spread.sqrt() < LEAST_SPREAD || all.all(|value| is_unit(&value)) {
                true => FLAT,
                false => 0.0,
            };
            flat + mean(&|i| beyond_colors([lightness[i], ab(0, i), ab(1, i)]))
        }
    };
    // Of values beyond all bounds nothing else can be said.
    if off.is_finite() { off.min(MOST) } else { MOST }
}
