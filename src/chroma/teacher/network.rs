//! A colorization network as a teacher.

use super::cache::{Cache, Question, hash_file, key};
use super::error::first_line;
use super::images::resample;
use super::model::{Fit, Port, Ports};
use super::profile::{self, OutputKind, Profile, Role};
use super::tensor::{self, Picture};
use super::{AbImage, GrayImage, HintImage, TeacherError, TeacherInfo, TeacherSettings};
use super::{Catalog, file_name, runtime};
use crate::color::srgb_to_lab;
use ort::session::{Session, SessionInputValue, builder::GraphOptimizationLevel};
use std::f32::consts::TAU;
use std::path::{Path, PathBuf};

/// A network is told of paint that covers at least this share of one of its
/// pixels; strokes are thinner than that pixel where it is a small network.
const HINT_COVER: f32 = 0.25;

/// Seed of the random code that some networks take.
const NOISE_SEED: u64 = 0;

/// An ONNX model that colors photos, with the answers it gave before.
pub struct NetworkTeacher {
    path: PathBuf,
    session: Session,
    ports: Ports,
    profile: Profile,
    fit: Fit,
    /// Side of the model's input where the model leaves it open.
    size: u32,
    sha256: String,
    cache: Option<Cache>,
}

impl NetworkTeacher {
    /// Opens a model; see [`Teacher::open`](super::Teacher::open).
    ///
    /// # Errors
    /// As for [`Teacher::open`](super::Teacher::open).
    pub fn open(
        path: &Path,
        cache_dir: Option<&Path>,
        settings: &TeacherSettings,
        catalog: &Catalog,
    ) -> Result<Self, TeacherError> {
        let manifest = path.with_extension("toml");
        let sha256 = hash_file(path).map_err(TeacherError::io(path))?;
        let known = catalog.identify(path, &sha256)?;
        let told = match (&settings.profile, known) {
            (Some(name), _) => Some(profile::named(name)?),
            _ if manifest.exists() => Some(Profile::read(&manifest)?),
            (None, Some(known)) => Some(known.contract()?),
            (None, None) => None,
        };
        let environment = runtime::environment()?;
        let session = load(path, &environment).map_err(|error| TeacherError::BadModel {
            path: path.to_path_buf(),
            reason: first_line(error),
        })?;
        let ports = Ports::of(&session);
        let (profile, fit) = match told {
            Some(profile) => {
                let fit = ports.check(path, &profile)?;
                (profile, fit)
            }
            None => ports.choose(path)?,
        };
        let size = settings.size.unwrap_or(profile.size);
        check_size(settings.size, &profile, &fit).map_err(|reason| TeacherError::BadSize {
            path: path.to_path_buf(),
            size,
            reason,
        })?;
        Ok(Self {
            path: path.to_path_buf(),
            session,
            ports,
            profile,
            fit,
            size,
            sha256,
            cache: cache_dir.map(Cache::open).transpose()?,
        })
    }

    pub(super) fn describe(&self) -> TeacherInfo {
        let square = [self.size; 2];
        TeacherInfo {
            name: file_name(&self.path),
            kind: self.profile.name.clone(),
            sha256: Some(self.sha256.clone()),
            input_size: Some(self.profile.input_size(square, self.fit.fixed, self.size)),
        }
    }

    /// Colors one photo; the answer has the network's size.
    pub(super) fn colorize(
        &mut self,
        name: &str,
        photo: GrayImage<'_>,
        hints: Option<&HintImage>,
    ) -> Result<AbImage, TeacherError> {
        let size = [photo.width, photo.height];
        let input = self.profile.input_size(size, self.fit.fixed, self.size);
        let takes_hints = self.fit.roles.contains(&Role::Hints);
        let hints = hints.filter(|_| takes_hints);
        let hints = hints.map(|hints| hints.resized(input[0], input[1]));
        let key = key(&Question {
            photo,
            model: &self.sha256,
            profile: &self.profile.identity(),
            input,
            hints: hints.as_ref().map(|hints| &hints.paint[..]),
        });
        if let Some(answer) = self.cache.as_ref().and_then(|cache| cache.load(&key)) {
            return Ok(answer);
        }
        let answer = self.ask(&photo, input, hints.as_ref());
        let answer = answer.map_err(|reason| TeacherError::Network {
            path: self.path.clone(),
            photo: name.to_string(),
            reason,
        })?;
        if let Some(cache) = &self.cache {
            cache.store(&key, &answer)?;
        }
        Ok(answer)
    }

    /// Runs the network on an input of this width and height: its answer at its
    /// own resolution, or what went wrong.
    fn ask(
        &mut self,
        photo: &GrayImage<'_>,
        size: [u32; 2],
        hints: Option<&HintImage>,
    ) -> Result<AbImage, String> {
        let picture = |values: Vec<f32>| Picture {
            layout: self.profile.layout,
            batch: self.fit.batch,
            size,
            values,
        };
        let inputs = self.fit.roles.iter().zip(&self.ports.inputs);
        let inputs: Result<Vec<SessionInputValue<'_>>, String> = inputs
            .map(|(&role, port)| match role {
                Role::Image => picture(image(&self.profile, photo, size)).tensor(port.element),
                Role::Hints | Role::Mask => {
                    picture(told(&self.profile, hints, size, role)).tensor(port.element)
                }
                Role::Class | Role::Noise | Role::Zeros => other(&self.profile, role, port),
            })
            .collect();
        let outputs = self.session.run(&inputs?[..]).map_err(first_line)?;
        let (shape, values) = tensor::read(&outputs[self.fit.answer])?;
        answer(&self.profile, &shape, &values)
    }
}

/// Whether a network can be asked at a side; if not, why not.
fn check_size(asked: Option<u32>, profile: &Profile, fit: &Fit) -> Result<(), String> {
    let Some(size) = asked else { return Ok(()) };
    if let Some(fixed) = fit.fixed.into_iter().flatten().find(|&fixed| fixed != size) {
        return Err(format!(
            "the model takes {fixed} and nothing else; leave the option out, or export the model anew"
        ));
    }
    let multiple = profile.size_multiple;
    if fit.fixed.contains(&None) && !size.is_multiple_of(multiple) {
        let next = size.next_multiple_of(multiple);
        return Err(format!("must be a multiple of {multiple}, such as {next}"));
    }
    Ok(())
}

/// The photo as the network takes it, `[channels, height, width]`.
fn image(profile: &Profile, photo: &GrayImage<'_>, size: [u32; 2]) -> Vec<f32> {
    let gray: Vec<[f32; 1]> = (photo.pixels.iter())
        .map(|&g| [f32::from(g) / 255.0])
        .collect();
    let photo_size = [photo.width, photo.height];
    // Lightness is taken of the small image, as the networks' own programs do.
    let gray = resample(&gray, photo_size, size, profile.filter);
    let channels = 0..profile.image.channels();
    let value = |channel| gray.iter().map(move |&[gray]| (gray, channel));
    let values = channels.flat_map(value);
    values
        .map(|(gray, channel)| profile.image_value(gray, channel))
        .collect()
}

/// What a network is told of hints at its own size: `[2, height, width]` for
/// their colors, `[1, height, width]` for the mask.
fn told(profile: &Profile, hints: Option<&HintImage>, size: [u32; 2], role: Role) -> Vec<f32> {
    let pixels = size[0] as usize * size[1] as usize;
    let mut colors = match hints {
        Some(hints) => hints.colors().collect(),
        None => vec![([0.0; 2], 0.0); pixels],
    };
    for (color, alpha) in &mut colors {
        let counts = *alpha >= HINT_COVER;
        *alpha = f32::from(counts);
        *color = if counts { *color } else { [0.0; 2] };
    }
    match role {
        Role::Mask => colors.iter().map(|&(_, alpha)| alpha).collect(),
        _ => (0..2)
            .flat_map(|channel| colors.iter().map(move |(color, _)| color[channel]))
            .map(|value| profile.hint(value))
            .collect(),
    }
}

/// An input that has nothing to do with the photo.
fn other(profile: &Profile, role: Role, port: &Port) -> Result<SessionInputValue<'static>, String> {
    let count = port.len().unwrap_or(0);
    let values = match role {
        Role::Noise => noise(count, profile.noise_std.unwrap_or(1.0)),
        _ => vec![0.0; count],
    };
    tensor::of(port.element, port.closed(), values)
}

/// Normal numbers of mean 0 (Box and Muller 1958), always the same.
fn noise(count: usize, deviation: f32) -> Vec<f32> {
    let mut random = fastrand::Rng::with_seed(NOISE_SEED);
    let mut normal = || {
        // In (0, 1], so that the logarithm is finite.
        let radius = (-2.0 * (1.0 - random.f32()).ln()).sqrt();
        deviation * radius * (TAU * random.f32()).cos()
    };
    (0..count).map(|_| normal()).collect()
}

/// The a, b of a network's output, or what is wrong with it.
fn answer(profile: &Profile, shape: &[i64], values: &[f32]) -> Result<AbImage, String> {
    let side = |side: i64| u32::try_from(side).ok().filter(|&side| side > 0);
    let channels = profile.output.channels();
    let sides = shape.try_into().map(|shape| profile.layout.sides(shape));
    let sides = match sides {
        Ok([batch, c, height, width]) if batch > 0 && c == channels as i64 => {
            side(width).zip(side(height))
        }
        _ => None,
    };
    let (width, height) =
        sides.ok_or_else(|| format!("its answer has the wrong shape {shape:?}"))?;
    let pixels = width as usize * height as usize;
    // Of several pictures, which are all the same, the first.
    let first = values.get(..pixels * channels);
    let first = first.ok_or_else(|| format!("its answer is shorter than its shape {shape:?}"))?;
    if let Some(value) = first.iter().find(|value| !value.is_finite()) {
        return Err(format!("its answer contains {value}"));
    }
    let at = |c: usize, i: usize| first[profile.layout.index(c, i, [channels, pixels])];
    let pixel = |i: usize| match profile.output {
        OutputKind::Ab => [0, 1].map(|c: usize| profile.ab(at(c, i))),
        OutputKind::Rgb => {
            let [_, a, b] = srgb_to_lab([0, 1, 2].map(|c: usize| profile.rgb(at(c, i)).into()));
            [a as f32, b as f32]
        }
    };
    let ab = (0..pixels).map(pixel).collect();
    Ok(AbImage { width, height, ab })
}

/// Loads a model so that one machine always answers alike: a fixed number of
/// threads (how a sum is divided depends on it) and kernels that repeat.
fn load(path: &Path, environment: &ort::environment::Environment) -> ort::Result<Session> {
    let threads = std::thread::available_parallelism().map_or(1, |count| count.get());
    Session::builder(environment)?
        .with_intra_threads(threads)?
        .with_inter_threads(1)?
        // Photos come one by one with other work between: no busy waiting.
        .with_intra_op_spinning(false)?
        .with_deterministic_compute(true)?
        .with_optimization_level(GraphOptimizationLevel::Level3)?
        // What goes wrong is in the errors.
        .with_log_level(ort::logging::LogLevel::Fatal)?
        .commit_from_file(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_normal_and_always_the_same() {
        let values = noise(20_000, 0.5);
        assert_eq!(values[..119], noise(119, 0.5));
        let mean = |power: i32| {
            let powers = values.iter().map(|v| f64::from(*v).powi(power));
            powers.sum::<f64>() / values.len() as f64
        };
        // Moments of a normal distribution: 0, σ², 0, 3 σ⁴.
        for (power, expected) in [(1, 0.0), (2, 0.25), (3, 0.0), (4, 0.1875)] {
            let found = mean(power);
            assert!((found - expected).abs() < 0.01, "{power}: {found}");
        }
    }
}
