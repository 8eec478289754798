//! A colorization network as a teacher.

use super::cache::{Cache, hash_file, key};
use super::error::first_line;
use super::images::resample;
use super::profile::{self, Profile};
use super::{AbImage, GrayImage, TeacherError, TeacherInfo, file_name, runtime};
use ort::session::{Session, builder::GraphOptimizationLevel};
use ort::value::Tensor;
use std::path::{Path, PathBuf};

/// An ONNX model that colours photos, with the answers it gave before.
pub struct NetworkTeacher {
    path: PathBuf,
    session: Session,
    profile: &'static Profile,
    /// Width and height of the model's input.
    input_size: [u32; 2],
    sha256: String,
    cache: Option<Cache>,
}

impl NetworkTeacher {
    /// Opens a model; see [`Teacher::open`](super::Teacher::open).
    ///
    /// # Errors
    /// As for [`Teacher::open`](super::Teacher::open).
    pub fn open(path: &Path, cache_dir: Option<&Path>) -> Result<Self, TeacherError> {
        let sha256 = hash_file(path).map_err(TeacherError::io(path))?;
        let environment = runtime::environment()?;
        let session = load(path, &environment).map_err(|error| TeacherError::BadModel {
            path: path.to_path_buf(),
            reason: first_line(error),
        })?;
        let (profile, input_size) =
            profile::choose(&session).ok_or_else(|| TeacherError::NoProfile {
                path: path.to_path_buf(),
                found: profile::describe_model(&session),
                accepted: profile::describe_accepted(),
            })?;
        Ok(Self {
            path: path.to_path_buf(),
            session,
            profile,
            input_size,
            sha256,
            cache: cache_dir.map(Cache::open).transpose()?,
        })
    }

    pub(super) fn describe(&self) -> TeacherInfo {
        TeacherInfo {
            name: file_name(&self.path),
            kind: self.profile.name,
            sha256: Some(self.sha256.clone()),
            input_size: Some(self.input_size),
        }
    }

    /// Colours one photo; the answer has the photo's size.
    pub(super) fn colorize(
        &mut self,
        name: &str,
        photo: GrayImage<'_>,
    ) -> Result<AbImage, TeacherError> {
        let key = key(&photo, &self.sha256, self.profile.name, self.input_size);
        let cached = self.cache.as_ref().and_then(|cache| cache.load(&key));
        let answer = match cached {
            Some(answer) => answer,
            None => {
                let answer = self.ask(&photo).map_err(|reason| TeacherError::Network {
                    path: self.path.clone(),
                    photo: name.to_string(),
                    reason,
                })?;
                if let Some(cache) = &self.cache {
                    cache.store(&key, &answer)?;
                }
                answer
            }
        };
        Ok(answer.resized(photo.width, photo.height))
    }

    /// Runs the network: its answer at its own resolution, or what went wrong.
    fn ask(&mut self, photo: &GrayImage<'_>) -> Result<AbImage, String> {
        let profile = self.profile;
        let [width, height] = self.input_size;
        let white = profile.white / 255.0;
        let gray: Vec<[f32; 1]> = photo
            .pixels
            .iter()
            .map(|&g| [f32::from(g) * white])
            .collect();
        let size = [photo.width, photo.height];
        let stretched = resample(&gray, size, self.input_size, profile.shrinking);
        let channels = profile.input_channels;
        let input = stretched.as_flattened().repeat(channels as usize);
        let shape = [1, channels, i64::from(height), i64::from(width)];
        let input = Tensor::from_array((shape, input)).map_err(first_line)?;

        let outputs = self.session.run(ort::inputs![input]).map_err(first_line)?;
        let (shape, values) = outputs[0].try_extract_tensor::<f32>().map_err(first_line)?;
        let side = |side: i64| u32::try_from(side).ok().filter(|&side| side > 0);
        let sides = match shape[..] {
            [1, c, height, width] if c == profile.output_channels => side(width).zip(side(height)),
            _ => None,
        };
        let (width, height) =
            sides.ok_or_else(|| format!("its answer has the wrong shape {:?}", &shape[..]))?;
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            return Err(format!("its answer contains {value}"));
        }
        let (a, b) = values.split_at(values.len() / 2);
        let scaled = |(a, b): (&f32, &f32)| [a, b].map(|value| value * profile.output_scale);
        let ab = a.iter().zip(b).map(scaled).collect();
        Ok(AbImage { width, height, ab })
    }
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
