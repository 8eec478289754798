//! On which processor a network runs: ONNX Runtime's execution providers.

use super::bounded::bounded;
use super::error::first_line;
use super::{TeacherDevice, TeacherError, TeacherSettings, runtime};
use ort::environment::Environment;
use ort::ep::{CUDA, CoreML, DirectML, ExecutionProvider, ExecutionProviderDispatch};
use ort::session::{Session, builder::GraphOptimizationLevel};
use std::path::Path;
use std::time::Duration;

/// Time limit of loading if that of an answer is shorter.
const LOADING: Duration = Duration::from_secs(60);

/// Devices that `Auto` tries, in this order.
const TRIED: [TeacherDevice; 4] = [
    TeacherDevice::Cuda,
    TeacherDevice::DirectMl,
    TeacherDevice::CoreMl,
    TeacherDevice::Cpu,
];

impl TeacherDevice {
    /// The provider to be registered; none for the processor, which is always there.
    ///
    /// # Errors
    /// The device's name where the library was built without it.
    fn provider(self) -> Result<Option<ExecutionProviderDispatch>, &'static str> {
        let (there, provider) = match self {
            Self::Auto | Self::Cpu => return Ok(None),
            Self::Cuda => (CUDA::is_available(), CUDA::default().build()),
            Self::DirectMl => (DirectML::is_available(), DirectML::default().build()),
            Self::CoreMl => (CoreML::is_available(), CoreML::default().build()),
        };
        match there {
            Ok(true) => Ok(Some(provider.error_on_failure())),
            _ => Err(self.name()),
        }
    }
}

/// Result of setting up a model, such as its session, and its device.
pub(super) struct SessionOn<T> {
    pub made: T,
    pub device: TeacherDevice,
    /// The devices that the library at hand has, and that come first, but that do not take the
    /// model; with what they say.
    pub refused: Vec<(TeacherDevice, String)>,
}

/// Loads a model.
///
/// # Errors
/// [`TeacherError::NoDevice`] where the library has not the one that is asked for,
/// [`TeacherError::BadModel`].
pub(super) fn load(
    path: &Path,
    environment: &Environment,
    settings: &TeacherSettings,
) -> Result<SessionOn<Session>, TeacherError> {
    let on = |device: TeacherDevice| {
        let provider = device.provider().map_err(|device| TeacherError::NoDevice {
            path: path.to_path_buf(),
            device,
        })?;
        let (own, environment) = (path.to_owned(), environment.clone());
        // What is constant in a network is computed at once.
        let load = move || session(&own, &environment, provider).map_err(first_line);
        let loaded = bounded(settings.time_limit.max(LOADING), || (), load);
        loaded
            .map_err(|(excess, _)| excess)
            .flatten()
            .map_err(|reason| TeacherError::BadModel {
                path: path.to_path_buf(),
                reason,
            })
    };
    let tried = match settings.device {
        TeacherDevice::Auto => &TRIED[..],
        _ => &[settings.device],
    };
    first_that_takes(tried, on)
}

/// Loads a model of another purpose as those of teachers are by default.
///
/// # Errors
/// [`TeacherError::BadModel`], and those of finding ONNX Runtime.
#[cfg(feature = "cli")]
pub(crate) fn load_model(path: &Path) -> Result<Session, TeacherError> {
    let placed = load(path, &runtime::environment()?, &TeacherSettings::default())?;
    Ok(placed.made)
}

/// Result on the first of some devices that succeeds; the last one's error if none does.
fn first_that_takes<T>(
    tried: &[TeacherDevice],
    on: impl Fn(TeacherDevice) -> Result<T, TeacherError>,
) -> Result<SessionOn<T>, TeacherError> {
    let mut refused = Vec::new();
    for (k, &device) in tried.iter().enumerate() {
        match on(device) {
            Ok(made) => {
                return Ok(SessionOn {
                    made,
                    device,
                    refused,
                });
            }
            Err(error) if k + 1 == tried.len() => return Err(error),
            // A library without it has nothing to say.
            Err(TeacherError::NoDevice { .. }) => (),
            Err(TeacherError::BadModel { reason, .. }) => refused.push((device, reason)),
            Err(error) => refused.push((device, first_line(error))),
        }
    }
    unreachable!("the last one is returned")
}

/// A session that always answers alike on one machine: a fixed number of threads (how a sum is
/// divided depends on it) and kernels that repeat.
fn session(
    path: &Path,
    environment: &Environment,
    provider: Option<ExecutionProviderDispatch>,
) -> ort::Result<Session> {
    let threads = std::thread::available_parallelism().map_or(1, |count| count.get());
    Session::builder(environment)?
        .with_execution_providers(provider.as_slice())?
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
    fn devices_that_fail_are_told_and_those_that_are_not_there_are_not() {
        let path = || "net.onnx".into();
        let on = |device| match device {
            TeacherDevice::Cuda => Err(TeacherError::BadModel {
                path: path(),
                reason: "no driver".into(),
            }),
            TeacherDevice::Cpu => Ok(7),
            other => Err(TeacherError::NoDevice {
                path: path(),
                device: other.name(),
            }),
        };
        let placed = first_that_takes(&TRIED, on).unwrap();
        assert_eq!((placed.made, placed.device), (7, TeacherDevice::Cpu));
        assert_eq!(
            placed.refused,
            [(TeacherDevice::Cuda, "no driver".to_owned())]
        );
        // What is asked for by name has no other to fall back on.
        let alone = first_that_takes(&[TeacherDevice::Cuda], on);
        assert!(matches!(alone, Err(TeacherError::BadModel { .. })));
    }
}
