//! Options of a network, wherever a command takes one.

use clap::Args;

use super::{headings::TEACHER, values::one_of};
use crate::chroma::teacher::{TeacherDevice, TeacherSettings};

/// On which processor networks run.
const DEVICES: &[(TeacherDevice, &str)] = &[
    (
        TeacherDevice::Auto,
        "The first that ONNX Runtime has and that accepts the network",
    ),
    (TeacherDevice::Cpu, "CPU"),
    (TeacherDevice::Cuda, "NVIDIA GPUs"),
    (TeacherDevice::DirectMl, "DirectX 12 on Windows"),
    (TeacherDevice::CoreMl, "Apple devices"),
];

/// Options of a network.
#[derive(Args, Clone)]
pub struct NetworkArguments {
    /// Input and output conventions of the network [default: detected].
    ///
    /// A profile (ddcolor, siggraph17, siggraph17-full, eccv16, caffe-v2, bigcolor, deoldify,
    /// deoldify-browser) or a manifest. Detected from FILE.toml beside FILE.onnx, the file's
    /// SHA-256, or its inputs and outputs.
    #[arg(long, value_name = "NAME|FILE.toml", requires = "teacher", help_heading = TEACHER, hide_short_help = true)]
    teacher_profile: Option<String>,
    /// Input size of a network that leaves it open, in pixels [default: the profile's].
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(1..=8192), requires = "teacher", help_heading = TEACHER, hide_short_help = true)]
    teacher_size: Option<u32>,
    /// Class for a network such as BigColor, by ImageNet's numbers [default: 0].
    #[arg(long, value_name = "N", requires = "teacher", help_heading = TEACHER, hide_short_help = true)]
    teacher_class: Option<u16>,
    /// Processor on which the network runs.
    #[arg(long, value_parser = one_of(DEVICES), default_value = "auto", help_heading = TEACHER, hide_short_help = true)]
    teacher_device: TeacherDevice,
}

impl NetworkArguments {
    /// Settings by the options, and defaults for the rest.
    pub(super) fn settings(self) -> TeacherSettings {
        TeacherSettings {
            profile: self.teacher_profile,
            size: self.teacher_size,
            class: self.teacher_class,
            device: self.teacher_device,
            ..TeacherSettings::default()
        }
    }
}
