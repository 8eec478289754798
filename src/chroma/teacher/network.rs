//! A colorization network as a teacher.

use super::bounded::bounded;
use super::cache::{Cache, Question, key};
use super::error::first_line;
use super::images::resample;
use super::model::{Fit, Port, Ports};
use super::profile::{self, OutputKind, Profile, Role};
use super::settings::file_name;
use super::tensor::{self, NetworkImage};
use super::{AbImage, GrayImage, HintImage};
use super::{Catalog, device, plausible, runtime, weights};
use super::{TeacherDevice, TeacherError, TeacherInfo, TeacherSettings};
use crate::color::srgb_to_lab;
use ort::session::{RunOptions, Session, SessionInputValue};
use serde::Serialize;
use std::f32::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// A network is told of paint that covers at least this share of one of its
/// pixels; strokes are thinner than that pixel where it is a small network.
const HINT_COVER: f32 = 0.25;

/// Seed of the random code that some networks take.
const NOISE_SEED: u64 = 0;

/// An ONNX model that colors photos, with the answers it gave before.
pub struct NetworkTeacher {
    pub(super) loaded: Loaded,
    pub(super) profile: Profile,
    fit: Fit,
    /// Side of the model's input where the model leaves it open.
    size: u32,
    time_limit: Duration,
    cache: Option<Cache>,
    /// True while the profile is guessed from tensor shapes and no answer has confirmed it.
    pub(super) supposed: bool,
    /// Error that prevents answers from being cached, if any.
    pub(super) unkept: Option<TeacherError>,
}

/// A model before it is known what its numbers mean.
pub(super) struct Loaded {
    pub path: PathBuf,
    pub ports: Ports,
    /// None once it has not ended in time.
    session: Option<Session>,
    device: TeacherDevice,
    /// See [`device::SessionOn`].
    refused: Vec<(TeacherDevice, String)>,
    sha256: String,
    /// Entry in the table of networks: its name there and its contract.
    pub known: Option<(String, Profile)>,
}

/// Source of a network's contract.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ProfileSource {
    /// `--teacher-profile`.
    User,
    /// The manifest beside the model.
    Manifest,
    /// The table of networks, which knows its SHA-256.
    Catalog,
    /// Its inputs and outputs.
    Shapes,
    /// Answers to what was tried.
    Trial,
}

impl Loaded {
    pub fn open(
        path: &Path,
        settings: &TeacherSettings,
        catalog: &Catalog,
    ) -> Result<Self, TeacherError> {
        let sha256 = weights::identity(path)?;
        let known = catalog.identify(path, &sha256)?;
        let known = known.map(|known| Ok((known.name.clone(), known.contract()?)));
        let environment = runtime::environment()?;
        let placed = device::load(path, &environment, settings)?;
        Ok(Self {
            path: path.to_path_buf(),
            ports: Ports::of(&placed.made),
            session: Some(placed.made),
            device: placed.device,
            refused: placed.refused,
            sha256,
            known: known.transpose()?,
        })
    }

    /// The model's contract by settings, manifest, table of networks or tensor shapes.
    pub fn contract(
        &self,
        settings: &TeacherSettings,
    ) -> Result<(Profile, Fit, ProfileSource), TeacherError> {
        let manifest = self.path.with_extension("toml");
        let (profile, by) = match (&settings.profile, &self.known) {
            (Some(name), _) => (profile::named(name)?, ProfileSource::User),
            _ if manifest.exists() => (Profile::read(&manifest)?, ProfileSource::Manifest),
            (None, Some((_, contract))) => (contract.clone(), ProfileSource::Catalog),
            (None, None) => {
                let (profile, fit) = self.ports.choose(&self.path)?;
                return Ok((profile, fit, ProfileSource::Shapes));
            }
        };
        let fit = self.ports.check(&self.path, &profile)?;
        Ok((profile, fit, by))
    }
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
        let loaded = Loaded::open(path, settings, catalog)?;
        let (profile, fit, by) = loaded.contract(settings)?;
        let mut teacher = Self::following(loaded, profile, fit, settings)?;
        teacher.supposed = by == ProfileSource::Shapes;
        match cache_dir.map(Cache::open).transpose() {
            Ok(cache) => teacher.cache = cache,
            Err(error) => teacher.unkept = Some(error),
        }
        Ok(teacher)
    }

    /// A model that is asked as a contract says which fits it, and keeps no answers.
    ///
    /// # Errors
    /// [`TeacherError::BadSize`] where it cannot be asked at the settings' size,
    /// [`TeacherError::NoClass`] where it takes none and the settings have one.
    pub(super) fn following(
        loaded: Loaded,
        mut profile: Profile,
        fit: Fit,
        settings: &TeacherSettings,
    ) -> Result<Self, TeacherError> {
        let size = settings.size.unwrap_or(profile.size);
        check_size(settings.size, &profile, &fit).map_err(|reason| TeacherError::BadSize {
            path: loaded.path.clone(),
            size,
            reason,
        })?;
        profile.class = settings.class.or(profile.class);
        if profile.class.is_some() && !profile.takes_class() {
            let path = loaded.path;
            return Err(TeacherError::NoClass { path });
        }
        Ok(Self {
            loaded,
            profile,
            fit,
            size,
            time_limit: settings.time_limit,
            cache: None,
            supposed: false,
            unkept: None,
        })
    }

    pub(super) fn describe(&self) -> TeacherInfo {
        let square = [self.size; 2];
        TeacherInfo {
            name: file_name(&self.loaded.path),
            kind: self.profile.name.clone(),
            sha256: Some(self.loaded.sha256.clone()),
            device: Some(self.loaded.device),
            input_size: Some(self.profile.input_size(square, self.fit.fixed, self.size)),
            class: self.profile.class,
        }
    }

    /// Warnings about preferred devices that failed, a line each.
    pub(super) fn passed_over(&self) -> Vec<String> {
        let (name, taken) = (file_name(&self.loaded.path), self.loaded.device.name());
        (self.loaded.refused.iter())
            .map(|(device, reason)| {
                let device = device.name();
                format!("{name} runs on {taken}: {device} is there, but fails ({reason})")
            })
            .collect()
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
            model: &self.loaded.sha256,
            device: self.loaded.device.name(),
            profile: &self.profile.identity(),
            input,
            hints: hints.as_ref().map(|hints| &hints.paint[..]),
        });
        let kept = self.cache.as_ref().and_then(|cache| cache.load(&key));
        let is_kept = kept.is_some();
        let answer = match kept {
            Some(answer) => answer,
            None => self.ask(name, &photo, input, hints.as_ref())?,
        };
        self.make_sure(name, &answer, &photo)?;
        if is_kept {
            return Ok(answer);
        }
        if let Some(Err(error)) = (self.cache.as_ref()).map(|cache| cache.store(&key, &answer)) {
            // It was the last: a disk that is full takes no other.
            self.cache = None;
            self.unkept = Some(error);
        }
        Ok(answer)
    }

    /// Runs the network on an input of this width and height: its answer at its own resolution.
    ///
    /// # Errors
    /// [`TeacherError::Network`], [`TeacherError::Senseless`] for colors that cannot be.
    fn ask(
        &mut self,
        name: &str,
        photo: &GrayImage<'_>,
        size: [u32; 2],
        hints: Option<&HintImage>,
    ) -> Result<AbImage, TeacherError> {
        let asked = self.numbers(photo, size, hints);
        let asked = asked.and_then(|(shape, values)| {
            let answer = answer(&self.profile, &shape, &values)?;
            Ok((answer, values))
        });
        let (answer, values) = asked.map_err(|reason| self.failed(name, reason))?;
        match values.iter().all(|&value| self.profile.can_be(value)) {
            true => Ok(answer),
            false => Err(self.senseless(name, values.into_iter())),
        }
    }

    /// Refuses what only shapes tell the contract of, where neither this answer nor that for a
    /// ramp bears it out.
    fn make_sure(
        &mut self,
        name: &str,
        answer: &AbImage,
        photo: &GrayImage<'_>,
    ) -> Result<(), TeacherError> {
        if self.supposed
            && self.profile.output == OutputKind::Ab
            && !plausible::is_ab(answer, photo)
        {
            let pixels = plausible::ramp();
            let ramp = plausible::as_image(&pixels);
            let size = [ramp.width, ramp.height];
            let size = self.profile.input_size(size, self.fit.fixed, self.size);
            let is_ab = match self.ask("a ramp", &ramp, size, None) {
                Ok(of_ramp) => plausible::is_ab(&of_ramp, &ramp),
                // Whoever fails on black may well color a photo without.
                Err(error) => !matches!(error, TeacherError::Senseless { .. }),
            };
            if !is_ab {
                return Err(self.senseless(name, answer.ab.iter().copied().flatten()));
            }
        }
        self.supposed = false;
        Ok(())
    }

    fn failed(&self, photo: &str, reason: String) -> TeacherError {
        TeacherError::Network {
            path: self.loaded.path.clone(),
            photo: photo.to_owned(),
            reason,
        }
    }

    fn senseless(&self, photo: &str, values: impl Iterator<Item = f32>) -> TeacherError {
        let range = values.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], value| {
            [low.min(value), high.max(value)]
        });
        TeacherError::Senseless {
            path: self.loaded.path.clone(),
            photo: photo.to_owned(),
            kind: self.profile.name.clone(),
            range,
        }
    }

    /// The same, before anything is made of it: the answer's sides and numbers.
    fn numbers(
        &mut self,
        photo: &GrayImage<'_>,
        size: [u32; 2],
        hints: Option<&HintImage>,
    ) -> Result<(Vec<i64>, Vec<f32>), String> {
        let picture = |values: Vec<f32>| NetworkImage {
            layout: self.profile.layout,
            batch: self.fit.batch,
            size,
            values,
        };
        let inputs = self.fit.roles.iter().zip(&self.loaded.ports.inputs);
        let inputs: Result<Vec<SessionInputValue<'_>>, String> = inputs
            .map(|(&role, port)| match role {
                Role::Image => picture(image(&self.profile, photo, size)).tensor(port.element),
                Role::Hints | Role::Mask => {
                    picture(told(&self.profile, hints, size, role)).tensor(port.element)
                }
                Role::Class | Role::Noise | Role::Zeros => other(&self.profile, role, port),
            })
            .collect();
        let (inputs, output) = (inputs?, self.fit.answer);
        let options = Arc::new(RunOptions::new().map_err(first_line)?);
        let stop = options.clone();
        let session = self.loaded.session.take();
        let mut session = session.ok_or("was given up before")?;
        let work = move || {
            let outputs = session.run_with_options(&*inputs, &*options);
            let outputs = outputs.map_err(first_line);
            let read = outputs.and_then(|outputs| tensor::read(&outputs[output]));
            (session, read)
        };
        match bounded(self.time_limit, move || drop(stop.terminate()), work) {
            Ok((session, read)) => {
                self.loaded.session = Some(session);
                read
            }
            Err((excess, late)) => {
                self.loaded.session = late.map(|(session, _)| session);
                Err(excess)
            }
        }
    }

    /// Asks about a picture without hints: the numbers as they come.
    ///
    /// # Errors
    /// [`TeacherError::Network`], also where one of them is not finite.
    pub(super) fn look(
        &mut self,
        name: &str,
        photo: &GrayImage<'_>,
    ) -> Result<Numbers, TeacherError> {
        let size = [photo.width, photo.height];
        let input = self.profile.input_size(size, self.fit.fixed, self.size);
        let looked = self.numbers(photo, input, None);
        let looked = looked.and_then(|(shape, values)| {
            let AbImage { width, height, .. } = answer(&self.profile, &shape, &values)?;
            Ok(Numbers {
                size: [width, height],
                values,
            })
        });
        looked.map_err(|reason| self.failed(name, reason))
    }
}

/// An answer before anything is made of it.
pub(super) struct Numbers {
    /// Width and height.
    pub size: [u32; 2],
    /// In the network's layout.
    pub values: Vec<f32>,
}

/// Checks that a network can run at a side; the error gives the reason.
fn check_size(asked: Option<u32>, profile: &Profile, fit: &Fit) -> Result<(), String> {
    let Some(size) = asked else { return Ok(()) };
    if let Some(fixed) = fit.fixed.into_iter().flatten().find(|&fixed| fixed != size) {
        return Err(format!(
            "the model takes {fixed} and nothing else; leave the option out, or export the model again"
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

/// Hints as the network receives them, at its own size: `[2, height, width]` for their colors,
/// `[1, height, width]` for the mask.
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
        Role::Class => vec![profile.class.unwrap_or(0).into(); count],
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

#[cfg(test)]
#[path = "network_tests.rs"]
mod tests;
