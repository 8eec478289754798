//! Programs of others, such as FFmpeg and COLMAP: started without a shell, fed, listened to, and
//! ended with this one.

mod film;
mod said;

pub(crate) use film::{Pictures, probe, probe_pictures};

use std::{
    ffi::OsString,
    io::{self, Read, Write},
    path::Path,
    process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus, Stdio},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, channel},
    },
    thread,
    time::Duration,
};

use said::{Last, Stream, listen};

use crate::disk;

/// Program that reads and writes films.
pub(crate) const FFMPEG: &str = "ffmpeg";

/// Set for this program where it is to end as after Ctrl-C once its standard input ends.
pub(crate) const TETHER: &str = "GS_CHROMA_TETHERED";

/// Interval of polling a program that has closed its output.
const PATIENCE: Duration = Duration::from_millis(5);

/// Programs that run, so that they can be ended.
static RUNNING: Mutex<Vec<Arc<Mutex<Child>>>> = Mutex::new(Vec::new());

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A list and a child are whole even where a thread has panicked.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Error of an external program.
#[derive(Debug, thiserror::Error)]
pub enum ProgramError {
    /// It is not installed.
    #[error("{program} is not installed, or not on PATH: {}", remedy(program))]
    Missing {
        /// Name of the program, as it was started.
        program: String,
    },
    #[error("{program} failed: {said}")]
    Failed {
        /// Name of the program, as it was started.
        program: String,
        /// Its last lines, and its exit status.
        said: String,
    },
}

impl ProgramError {
    /// Returns true if FFmpeg or ffprobe is not installed.
    pub fn lacks_ffmpeg(&self) -> bool {
        matches!(self, Self::Missing { program } if matches!(program.as_str(), "ffmpeg" | "ffprobe"))
    }
}

/// Installation hint of a program.
fn remedy(program: &str) -> &'static str {
    match program {
        "ffmpeg" | "ffprobe" => {
            "install FFmpeg 5.1 or newer (Debian, Ubuntu: apt-get install ffmpeg; Fedora: dnf install ffmpeg-free; macOS: brew install ffmpeg; Windows: winget install Gyan.FFmpeg)"
        }
        "colmap" => {
            "install COLMAP (Debian, Ubuntu: apt-get install colmap; macOS: brew install colmap; others: https://colmap.github.io/install.html)"
        }
        _ => "install it",
    }
}

/// Ends all programs that were started: for a program that is told to end at once. None can be
/// started or found to have ended as long as what is given back lives.
#[cfg(feature = "cli")]
pub(crate) fn end_all() -> impl Sized {
    let running = locked(&RUNNING);
    for child in running.iter() {
        let mut child = locked(child);
        // Whoever is gone already is ended.
        let _ = child.kill();
        let _ = child.wait();
    }
    running
}

/// A program with its arguments.
#[derive(Clone, Debug)]
pub(crate) struct Program {
    /// Name on `PATH`, or path.
    name: OsString,
    arguments: Vec<OsString>,
    /// True if it ends by itself once its standard input does.
    tethered: bool,
}

/// What holds a program that ends by itself once this is cut, or gone.
#[derive(Debug, Default)]
pub(crate) struct Tether {
    input: Mutex<Option<ChildStdin>>,
    is_cut: AtomicBool,
}

impl Tether {
    /// Lets the program end.
    pub fn cut(&self) {
        self.is_cut.store(true, Ordering::SeqCst);
        drop(locked(&self.input).take());
    }

    fn hold(&self, input: Option<ChildStdin>) {
        *locked(&self.input) = input;
        if self.is_cut.load(Ordering::SeqCst) {
            self.cut();
        }
    }
}

/// A program that runs.
#[derive(Debug)]
struct Running {
    child: Arc<Mutex<Child>>,
}

/// A program that is given bytes. Dropped, it is ended.
#[derive(Debug)]
pub(crate) struct PipedProgram {
    program: Program,
    running: Option<Running>,
    input: Option<ChildStdin>,
    lines: Receiver<(Stream, String)>,
}

impl Program {
    pub fn new(name: impl Into<OsString>) -> Self {
        Self {
            name: name.into(),
            arguments: Vec::new(),
            tethered: false,
        }
    }

    /// Adds an argument.
    pub fn arg(mut self, argument: impl Into<OsString>) -> Self {
        self.arguments.push(argument.into());
        self
    }

    /// Adds arguments.
    pub fn args<A: Into<OsString>>(mut self, arguments: impl IntoIterator<Item = A>) -> Self {
        self.arguments.extend(arguments.into_iter().map(Into::into));
        self
    }

    /// Adds an option and its value.
    pub fn option(self, name: &str, value: impl Into<OsString>) -> Self {
        self.arg(name).arg(value)
    }

    /// Runs it in a folder, and hands every line that it says to `heard`; at the end all that
    /// was said of the last [`said::KEPT_LINES`] lines.
    pub fn run(self, folder: &Path, heard: &mut dyn FnMut(&str)) -> Result<(), ProgramError> {
        let (running, _, output, error) = self.start(folder, Stdio::null())?;
        let mut last = Last::default();
        for (stream, line) in lines_of(output, error) {
            heard(&line);
            last.keep(stream, line);
        }
        self.judge(running.finish(), &last)
    }

    /// Runs this very program as [`Program::run`] does, but lets it end by itself, with a checkpoint,
    /// once the tether is cut or this process is gone.
    pub fn run_tethered(
        mut self,
        folder: &Path,
        tether: &Tether,
        heard: &mut dyn FnMut(&str),
    ) -> Result<(), ProgramError> {
        self.tethered = true;
        let (running, input, output, error) = self.start(folder, Stdio::piped())?;
        tether.hold(input);
        let mut last = Last::default();
        for (stream, line) in lines_of(output, error) {
            heard(&line);
            last.keep(stream, line);
        }
        self.judge(running.finish(), &last)
    }

    /// Starts it in the current folder, to be given bytes on its standard input.
    pub fn feed(self) -> Result<PipedProgram, ProgramError> {
        let (running, input, output, error) = self.start(Path::new("."), Stdio::piped())?;
        Ok(PipedProgram {
            program: self,
            running: Some(running),
            input,
            lines: lines_of(output, error),
        })
    }

    /// Runs it in the current folder, and gives all that it says on standard output and standard
    /// error.
    pub fn ask(self) -> Result<String, ProgramError> {
        let mut said = String::new();
        self.run(Path::new("."), &mut |line| {
            said.push_str(line);
            said.push('\n');
        })?;
        Ok(said)
    }

    /// Runs it in the current folder and lets `take` read its standard output, until that is
    /// at an end or `take` says that it has enough (`false`).
    #[cfg(feature = "cli")]
    pub fn read(
        self,
        mut take: impl FnMut(&mut dyn Read) -> io::Result<bool>,
    ) -> Result<(), ProgramError> {
        let (running, _, mut stdout, error) = self.start(Path::new("."), Stdio::null())?;
        let (sender, lines) = channel();
        listen(error, sender, Stream::Error);
        let enough = loop {
            match take(&mut stdout) {
                Ok(true) => {}
                Ok(false) => break true,
                // The end of what it says.
                Err(_) => break false,
            }
        };
        if enough {
            // It has done its part.
            let _ = locked(&running.child).kill();
        }
        drop(stdout);
        let mut last = Last::default();
        for (stream, line) in lines {
            last.keep(stream, line);
        }
        match enough {
            true => running.finish().map(|_| ()).map_err(|e| self.failed(e)),
            false => self.judge(running.finish(), &last),
        }
    }

    /// Starts it; gives the ends of its pipes that are here.
    fn start(
        &self,
        folder: &Path,
        input: Stdio,
    ) -> Result<(Running, Option<ChildStdin>, ChildStdout, ChildStderr), ProgramError> {
        let mut command = Command::new(&self.name);
        command
            .args(&self.arguments)
            .current_dir(folder)
            // COLMAP asks Qt for a display even where it shows nothing.
            .env("QT_QPA_PLATFORM", "offscreen")
            // A fault of a test is this program's own.
            .env_remove(disk::FAULT)
            .stdin(input)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        if self.tethered {
            command.env(TETHER, "1");
        }
        // Listed before anybody can end it.
        let mut running = locked(&RUNNING);
        let mut child = command.spawn().map_err(|error| self.failed(error))?;
        let input = child.stdin.take();
        let pipes = child.stdout.take().zip(child.stderr.take());
        let child = Arc::new(Mutex::new(child));
        if !self.tethered {
            running.push(child.clone());
        }
        drop(running);
        let running = Running { child };
        let (output, error) = pipes.ok_or_else(|| self.failed(io::ErrorKind::BrokenPipe.into()))?;
        Ok((running, input, output, error))
    }

    /// The program's name as users know it.
    fn known_as(&self) -> String {
        let name = Path::new(&self.name).file_stem();
        name.unwrap_or(&self.name).to_string_lossy().into_owned()
    }

    fn failed(&self, error: io::Error) -> ProgramError {
        match error.kind() {
            io::ErrorKind::NotFound => ProgramError::Missing {
                program: self.known_as(),
            },
            _ => ProgramError::Failed {
                program: self.known_as(),
                said: error.to_string(),
            },
        }
    }

    fn judge(&self, ended: io::Result<ExitStatus>, last: &Last) -> Result<(), ProgramError> {
        let status = ended.map_err(|error| self.failed(error))?;
        if status.success() {
            return Ok(());
        }
        let told = last.told();
        Err(ProgramError::Failed {
            program: self.known_as(),
            said: match told.is_empty() {
                true => status.to_string(),
                false => format!("{} ({status})", told.join(" / ")),
            },
        })
    }
}

impl PipedProgram {
    /// Gives it bytes.
    ///
    /// # Errors
    /// [`ProgramError::Failed`]: it has ended, and says why.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), ProgramError> {
        let written = match &mut self.input {
            Some(input) => input.write_all(bytes),
            None => Err(io::ErrorKind::BrokenPipe.into()),
        };
        let Err(error) = written else { return Ok(()) };
        self.end()?;
        Err(self.program.failed(error))
    }

    /// Lets it come to its end.
    pub fn finish(mut self) -> Result<(), ProgramError> {
        self.end()
    }

    fn end(&mut self) -> Result<(), ProgramError> {
        drop(self.input.take());
        let mut last = Last::default();
        for (stream, line) in &self.lines {
            last.keep(stream, line);
        }
        match self.running.take() {
            Some(running) => self.program.judge(running.finish(), &last),
            None => Ok(()),
        }
    }
}

/// All lines of both, until both are closed.
fn lines_of(output: ChildStdout, error: ChildStderr) -> Receiver<(Stream, String)> {
    let (sender, lines) = channel();
    listen(output, sender.clone(), Stream::Output);
    listen(error, sender, Stream::Error);
    lines
}

impl Running {
    /// Waits for its end; whoever ends all programs keeps this from returning.
    fn finish(self) -> io::Result<ExitStatus> {
        loop {
            // Not `Child::wait`, which would keep others from ending it.
            let ended = locked(&self.child).try_wait();
            if let Some(ended) = ended.transpose() {
                return ended;
            }
            thread::sleep(PATIENCE);
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let mut running = locked(&RUNNING);
        running.retain(|child| !Arc::ptr_eq(child, &self.child));
        drop(running);
        let mut child = locked(&self.child);
        if matches!(child.try_wait(), Ok(None)) {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn lines_are_heard_and_the_last_are_told() {
        let mut heard = Vec::new();
        let script = "printf 'one\\rtwo\\n\\n'; echo three >&2; exit 3";
        let failed = Program::new("sh")
            .args(["-c", script])
            .run(Path::new("."), &mut |line| heard.push(line.to_owned()));
        heard.sort();
        assert_eq!(heard, ["one", "three", "two"]);
        let told = failed.unwrap_err().to_string();
        assert!(told.contains("three") && told.contains("sh"), "{told}");
        let none = Program::new("no-such-program-at-all").ask();
        assert!(matches!(none, Err(ProgramError::Missing { .. })));
    }

    #[cfg(unix)]
    #[test]
    fn a_program_that_is_fed_hears_all_and_says_why_it_fails() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("heard");
        let mut cat = Program::new("sh")
            .args(["-c", "cat > \"$0\""])
            .arg(&path)
            .feed()
            .unwrap();
        for part in ["one ", "two"] {
            cat.write(part.as_bytes()).unwrap();
        }
        cat.finish().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"one two");
        let script = "read first; echo no such codec >&2; exit 3";
        let mut fails = Program::new("sh").args(["-c", script]).feed().unwrap();
        let failed = (0..1000).find_map(|_| fails.write(b"line\n").err());
        let told = failed
            .or_else(|| fails.finish().err())
            .map(|e| e.to_string());
        let told = told.unwrap_or_default();
        assert!(told.contains("sh failed: no such codec"), "{told}");
    }

    #[cfg(all(unix, feature = "cli"))]
    #[test]
    fn a_program_that_has_said_enough_is_ended() {
        let mut bytes = [0; 4];
        let mut count = 0;
        let enough = Program::new("cat").arg("/dev/zero").read(|from| {
            from.read_exact(&mut bytes)?;
            count += 1;
            Ok(count < 3)
        });
        assert!(enough.is_ok());
        assert_eq!(count, 3);
    }
}
