//! Work of ONNX Runtime within bounds of time and memory: a loop in a network may never end, and
//! may allocate all there is.

use crate::input;
use std::path::Path;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

/// Time between two looks at what it takes.
const LOOK: Duration = Duration::from_millis(100);

/// Time to end once it is told to, which is heeded between two operations.
const GRACE: Duration = Duration::from_secs(2);

/// Memory that any network may take, in KiB; and half of the machine's where that is more. The
/// largest that are known take 4 GiB.
const ROOM: u64 = 8 << 20;

/// Stack size in bytes, that of the main thread: networks are trees of any depth.
const STACK: usize = 8 << 20;

/// Does `work` on a thread of its own; `stop` tells it to end before it has. What does not end
/// even then is left behind, with all that it has.
///
/// # Errors
/// The limit exceeded and the remedy, with the result if it still came.
pub(super) fn bounded<T: Send + 'static>(
    limit: Duration,
    stop: impl FnOnce(),
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, (String, Option<T>)> {
    bounded_by(limit, most_memory(), stop, work)
}

/// The same with a bound, in KiB, of the program's resident memory.
fn bounded_by<T: Send + 'static>(
    limit: Duration,
    most: Option<u64>,
    stop: impl FnOnce(),
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, (String, Option<T>)> {
    let (done, finished) = mpsc::channel();
    // Nobody listens any more where it was left behind.
    let work = move || drop(done.send(work()));
    let thread = thread::Builder::new().stack_size(STACK);
    let spawned = thread.spawn(work);
    spawned.map_err(|error| (error.to_string(), None))?;
    let begun = Instant::now();
    let excess = loop {
        match finished.recv_timeout(LOOK.min(limit.saturating_sub(begun.elapsed()))) {
            Ok(result) => return Ok(result),
            Err(RecvTimeoutError::Disconnected) => return Err(("panicked".to_owned(), None)),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let remedy = "ask it at a smaller size";
        if begun.elapsed() >= limit {
            break format!("gave no answer within {} s: {remedy}", limit.as_secs_f64());
        }
        if let Some(most) = most.filter(|most| resident() > Some(*most)) {
            break format!("took the program beyond {} MiB: {remedy}", most >> 10);
        }
    };
    stop();
    Err((excess, finished.recv_timeout(GRACE).ok()))
}

/// The resident memory, in KiB, that the program may reach; an eighth of what is left is for
/// others. `None` where the system does not tell.
fn most_memory() -> Option<u64> {
    let told = |key| input::kib(Path::new("/proc/meminfo"), key);
    let left = told("MemAvailable:")?;
    let room = ROOM.max(told("MemTotal:")? / 2).min(left - left / 8);
    Some(resident()? + room)
}

fn resident() -> Option<u64> {
    input::kib(Path::new("/proc/self/status"), "VmRSS:")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    #[test]
    fn what_does_not_end_is_told_to_and_left_behind() {
        let second = Duration::from_secs(1);
        assert_eq!(bounded(second, || (), || 7), Ok(7));
        let told = Arc::new(AtomicBool::new(false));
        let (tell, heed) = (told.clone(), told);
        let begun = Instant::now();
        let endless = move || {
            while !heed.load(Ordering::SeqCst) {
                thread::sleep(Duration::from_millis(1));
            }
        };
        let stop = || tell.store(true, Ordering::SeqCst);
        let (excess, late) = bounded(Duration::from_millis(50), stop, endless).unwrap_err();
        assert!(excess.contains("within 0.05 s"), "{excess}");
        assert_eq!(late, Some(()));
        assert!(begun.elapsed() < second);
        assert!(bounded(second, || (), || panic!("of the test")).is_err());
        let long = || thread::sleep(Duration::from_secs(60));
        if cfg!(target_os = "linux") {
            let (excess, late) = bounded_by(30 * second, Some(7 << 10), || (), long).unwrap_err();
            assert!(
                excess.contains("beyond 7 MiB") && late.is_none(),
                "{excess}"
            );
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_system_tells_what_there_is() {
        assert!(most_memory() > resident() && resident() > Some(0));
    }
}
