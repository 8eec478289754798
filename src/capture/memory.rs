//! Room for photos that are being decoded: there may be many processors, and little memory.

use std::sync::{Condvar, Mutex, PoisonError};

use super::sample::LARGEST_FILE;

/// Largest memory of photos decoded at once, in bytes: two of the largest, some fourteen of 24
/// million RGB pixels.
const ALL: u64 = 2 * LARGEST_FILE;

/// Memory shared by all decoding threads of the program.
static ROOM: SharedBytes = SharedBytes::new(ALL);

/// A number of bytes that several threads share.
struct SharedBytes {
    size: u64,
    taken: Mutex<u64>,
    given_back: Condvar,
}

/// Bytes that are taken until this is dropped.
pub(super) struct ReservedBytes {
    room: &'static SharedBytes,
    bytes: u64,
}

/// Waits until there is room for a photo of so many bytes. Whoever holds some must not wait for
/// more.
pub(super) fn wait_for(bytes: u64) -> ReservedBytes {
    ROOM.wait_for(bytes)
}

impl SharedBytes {
    const fn new(size: u64) -> Self {
        Self {
            size,
            taken: Mutex::new(0),
            given_back: Condvar::new(),
        }
    }

    fn wait_for(&'static self, bytes: u64) -> ReservedBytes {
        // One that is larger than all of it has it for itself.
        let bytes = bytes.min(self.size);
        // A number is whole even where a thread has panicked.
        let taken = self.taken.lock().unwrap_or_else(PoisonError::into_inner);
        let full = |taken: &mut u64| *taken + bytes > self.size;
        let waited = self.given_back.wait_while(taken, full);
        *waited.unwrap_or_else(PoisonError::into_inner) += bytes;
        ReservedBytes { room: self, bytes }
    }
}

impl Drop for ReservedBytes {
    fn drop(&mut self) {
        let taken = self.room.taken.lock();
        *taken.unwrap_or_else(PoisonError::into_inner) -= self.bytes;
        self.room.given_back.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use std::{
        sync::atomic::{AtomicU64, Ordering},
        thread,
    };

    use super::*;

    #[test]
    fn no_more_is_taken_than_there_is() {
        static SMALL: SharedBytes = SharedBytes::new(10);
        let (taken, most) = (AtomicU64::new(0), AtomicU64::new(0));
        thread::scope(|scope| {
            for bytes in [3, 10, 4, 4, 25, 1, 7, 5] {
                let (taken, most) = (&taken, &most);
                scope.spawn(move || {
                    for _ in 0..50 {
                        let held = SMALL.wait_for(bytes);
                        let now = taken.fetch_add(held.bytes, Ordering::SeqCst) + held.bytes;
                        most.fetch_max(now, Ordering::SeqCst);
                        thread::yield_now();
                        taken.fetch_sub(held.bytes, Ordering::SeqCst);
                    }
                });
            }
        });
        assert_eq!(most.load(Ordering::SeqCst), 10);
        assert_eq!(*SMALL.taken.lock().unwrap(), 0);
    }
}
