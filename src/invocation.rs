//! The way in which the program was started: by itself, or by a process that has it as a library,
//! such as Python's.

use std::{env, ffi::OsString, path::PathBuf, sync::OnceLock};

/// The invocation of this process.
static PRESENT: OnceLock<Invocation> = OnceLock::new();

/// Command, arguments and libraries of the program.
#[derive(Clone, Debug, Default)]
pub struct Invocation {
    /// Words that start the program once more; its arguments follow.
    pub command: Vec<OsString>,
    /// Arguments of the program.
    pub arguments: Vec<OsString>,
    /// Folders in which ONNX Runtime is looked for first.
    pub libraries: Vec<PathBuf>,
}

impl Invocation {
    /// The present one: the program's own, unless another was declared.
    pub fn present() -> &'static Self {
        PRESENT.get_or_init(Self::own)
    }

    /// Declares that of a process that has the program as a library; the first one counts.
    pub fn declare(self) {
        let _first = PRESENT.set(self);
    }

    fn own() -> Self {
        let program = env::current_exe().ok();
        let folder = program.as_deref().and_then(|program| program.parent());
        Self {
            libraries: folder.map(PathBuf::from).into_iter().collect(),
            command: program.map(OsString::from).into_iter().collect(),
            arguments: env::args_os().skip(1).collect(),
        }
    }
}

/// Environment variables that the program sets to 1: libraries ask for nothing else.
pub fn variables() -> Vec<&'static str> {
    let mut set = vec![
        // ONNX Runtime queues its telemetry and looks for its host whatever its API is told.
        "ORT_DISABLE_TELEMETRY",
    ];
    if cfg!(target_os = "linux") && env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Without a session, Mesa's device-selection layer complains on standard error about the
        // Wayland display that it cannot ask; there is nothing to select by then.
        set.push("NODEVICE_SELECT");
    }
    set
}
