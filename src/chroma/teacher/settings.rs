//! Settings of a teacher, and its description in reports.

use super::Upsample;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Duration;

/// On which processor networks run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum TeacherDevice {
    /// The first of the others that the library at hand has and that takes the network.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// NVIDIA's GPUs.
    Cuda,
    /// DirectX 12, on Windows.
    DirectMl,
    /// Apple's.
    CoreMl,
}

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
}

/// Settings of a teacher.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TeacherSettings {
    /// A network's contract: the name of a built-in profile or the path of a
    /// `.toml` manifest. None for the manifest beside the model, or what its
    /// inputs and outputs say.
    pub profile: Option<String>,
    /// Side in pixels of a network's input where the model leaves it open; none
    /// for the profile's.
    pub size: Option<u32>,
    /// The class of a network that takes one; none for the profile's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub class: Option<u16>,
    /// On which processor a network runs.
    pub device: TeacherDevice,
    /// Enlargement of answers smaller than the photo.
    pub upsample: Upsample,
    /// Time limit of a network for one photo.
    pub time_limit: Duration,
}

impl Default for TeacherSettings {
    fn default() -> Self {
        Self {
            profile: None,
            size: None,
            class: None,
            device: TeacherDevice::default(),
            upsample: Upsample::default(),
            // The largest of the networks known take 20 s on two old cores.
            time_limit: Duration::from_secs(600),
        }
    }
}

/// Description of a teacher in reports.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct TeacherInfo {
    /// Name of its file or folder.
    pub name: String,
    /// The network's profile, a manifest's `name`, or `folder`.
    pub kind: String,
    /// SHA-256 of the `.onnx` file and its weight files.
    ///
    /// Hexadecimal; `None` for a folder.
    pub sha256: Option<String>,
    /// Device that the network ran on.
    ///
    /// `None` for a folder.
    pub device: Option<TeacherDevice>,
    /// Width and height that the network sees, in pixels.
    ///
    /// `None` for a folder. Twice the shorter side where the longer follows the photo's aspect.
    pub input_size: Option<[u32; 2]>,
    /// Class that the network was asked with, where one was chosen.
    #[serde(default)]
    pub class: Option<u16>,
}

/// The last part of a path, for reports.
pub(super) fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}
