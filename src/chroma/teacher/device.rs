//! On which processor a network runs: ONNX Runtime's execution providers.

use super::TeacherError;
use super::error::first_line;
use ort::environment::Environment;
use ort::ep::{CUDA, CoreML, DirectML, ExecutionProvider, ExecutionProviderDispatch};
use ort::session::{Session, builder::GraphOptimizationLevel};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// On which processor networks run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TeacherDevice {
    /// The first of the others that the library at hand has and that takes the network.
    #[default]
    Auto,
    /// The processor.
    Cpu,
    /// NVIDIA's GPUs.
    Cuda,
    /// DirectX 12, on Windows.
    DirectMl,
    /// Apple's.
    CoreMl,
}

/// What `Auto` tries, in this order.
const TRIED: [TeacherDevice; 4] = [
    TeacherDevice::Cuda,
    TeacherDevice::DirectMl,
    TeacherDevice::CoreMl,
    TeacherDevice::Cpu,
];

impl TeacherDevice {
    /// Its name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Cpu => "cpu",
            Self::Cuda => "cuda",
            Self::DirectMl => "directml",
            Self::CoreMl => "coreml",
        }
    }

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

/// Loads a model, and says where it runs.
///
/// # Errors
/// [`TeacherError::NoDevice`] where the library has not the one that is asked for,
/// [`TeacherError::BadModel`].
pub(super) fn load(
    path: &Path,
    environment: &Environment,
    device: TeacherDevice,
) -> Result<(Session, TeacherDevice), TeacherError> {
    let on = |device: TeacherDevice| {
        let provider = device.provider().map_err(|device| TeacherError::NoDevice {
            path: path.to_path_buf(),
            device,
        })?;
        let session = session(path, environment, provider);
        session.map_err(|error| TeacherError::BadModel {
            path: path.to_path_buf(),
            reason: first_line(error),
        })
    };
    if device != TeacherDevice::Auto {
        return Ok((on(device)?, device));
    }
    let [others @ .., last] = TRIED;
    let taken = others
        .into_iter()
        .find_map(|device| Some((on(device).ok()?, device)));
    match taken {
        Some(taken) => Ok(taken),
        None => Ok((on(last)?, last)),
    }
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
