//! How a network is to be asked, wherever a command takes one.

use std::time::Duration;

use clap::Args;

use super::values::one_of;
use crate::chroma::teacher::{TeacherDevice, TeacherSettings};

/// On which processor networks run.
const DEVICES: &[(TeacherDevice, &str)] = &[
    (
        TeacherDevice::Auto,
        "The first that the ONNX Runtime at hand has and that takes the network",
    ),
    (TeacherDevice::Cpu, "The processor"),
    (TeacherDevice::Cuda, "NVIDIA's GPUs"),
    (TeacherDevice::DirectMl, "DirectX 12, on Windows"),
    (TeacherDevice::CoreMl, "Apple's"),
];

/// How a network is to be asked.
#[derive(Args)]
pub struct NetworkArguments {
    /// What the network takes and gives: a profile (ddcolor, siggraph17, siggraph17-full, eccv16,
    /// caffe-v2, bigcolor, deoldify, deoldify-browser) or a manifest [default: FILE.toml beside
    /// FILE.onnx, or what its SHA-256, or its inputs and outputs, tell].
    #[arg(long, value_name = "NAME|FILE.toml", requires = "teacher")]
    teacher_profile: Option<String>,
    /// Side in pixels at which a network sees photos, where it leaves that open [default: the profile's].
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..=8192), requires = "teacher")]
    teacher_size: Option<u32>,
    /// On which processor the network runs.
    #[arg(long, value_parser = one_of(DEVICES), default_value = "auto")]
    teacher_device: TeacherDevice,
    /// Seconds after which a network that has not answered for a photo is given up.
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u32).range(1..), default_value_t = 600)]
    teacher_timeout: u32,
}

impl NetworkArguments {
    /// What was said of it, and defaults for the rest.
    pub(super) fn settings(self) -> TeacherSettings {
        TeacherSettings {
            profile: self.teacher_profile,
            size: self.teacher_size,
            device: self.teacher_device,
            time_limit: Duration::from_secs(self.teacher_timeout.into()),
            ..TeacherSettings::default()
        }
    }
}
