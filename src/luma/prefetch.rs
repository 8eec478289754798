//! Loading ahead of the loop.

use std::{
    collections::VecDeque,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, Sender, SyncSender, channel, sync_channel},
    },
    thread,
};

/// Threads that load, and items that are ahead: a photo of 24 megapixels takes a few tenths
/// of a second to decode and, in gray, 24 MB.
const AHEAD: usize = 4;

/// Loader of an item by number.
type Load<T> = Arc<dyn Fn(usize) -> T + Send + Sync>;

/// An item that is wanted, and who waits for it.
type Order<T> = (usize, SyncSender<T>);

/// Items that are wanted soon are loaded by threads meanwhile.
pub struct Prefetch<T> {
    load: Load<T>,
    orders: Sender<Order<T>>,
    ahead: VecDeque<(usize, Receiver<T>)>,
}

impl<T: Send + 'static> Prefetch<T> {
    /// Starts the threads; they end with this.
    pub fn new(load: Load<T>) -> Self {
        let (orders, taken) = channel::<Order<T>>();
        let taken = Arc::new(Mutex::new(taken));
        for _ in 0..AHEAD {
            let (load, taken) = (load.clone(), taken.clone());
            thread::spawn(move || {
                loop {
                    let order = taken.lock().unwrap_or_else(PoisonError::into_inner).recv();
                    let Ok((item, reply)) = order else {
                        break;
                    };
                    // Whoever wanted it may have changed their mind.
                    let _ = reply.send(load(item));
                }
            });
        }
        Self {
            load,
            orders,
            ahead: VecDeque::new(),
        }
    }

    /// An item. Those of `next` are loaded afterwards, as many as are loaded ahead.
    pub fn take(&mut self, item: usize, next: impl Iterator<Item = usize>) -> T {
        // What was expected and is not wanted is dropped.
        while self.ahead.front().is_some_and(|&(first, _)| first != item) {
            self.ahead.pop_front();
        }
        let ordered = self.ahead.pop_front();
        let next: Vec<usize> = next.take(AHEAD).collect();
        let kept = self
            .ahead
            .iter()
            .zip(&next)
            .take_while(|(have, want)| have.0 == **want);
        let kept = kept.count();
        self.ahead.truncate(kept);
        for &item in &next[kept..] {
            let (reply, loaded) = sync_channel(1);
            if self.orders.send((item, reply)).is_ok() {
                self.ahead.push_back((item, loaded));
            }
        }
        let loaded = ordered.and_then(|(_, loaded)| loaded.recv().ok());
        // Nobody was asked before, or the thread is gone.
        loaded.unwrap_or_else(|| (self.load)(item))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn what_is_taken_is_what_was_asked_for_in_whatever_order() {
        let loads = Arc::new(AtomicUsize::new(0));
        let counted = loads.clone();
        let mut prefetch = Prefetch::new(Arc::new(move |item| {
            counted.fetch_add(1, Ordering::Relaxed);
            10 * item
        }));
        for item in 0..50 {
            assert_eq!(prefetch.take(item, item + 1..50), 10 * item);
        }
        // Each was loaded once, all but the first ahead.
        assert_eq!(loads.load(Ordering::Relaxed), 50);
        // Back to the beginning, as after an overflow.
        for item in [7, 3, 4, 9, 0] {
            assert_eq!(prefetch.take(item, item + 1..50), 10 * item);
        }
        assert_eq!(prefetch.take(5, 0..0), 50);
        assert!(prefetch.ahead.is_empty());
    }
}
