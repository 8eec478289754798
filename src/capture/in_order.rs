//! Work done ahead by several threads and taken in order.

use std::{num::NonZero, sync::mpsc::sync_channel, thread};

/// Makes something of each item on as many threads as there are processors, and hands what
/// they make to `take` in the items' order. Each thread is at most two items ahead, so
/// that little is held however many items there are. Ends with the first error of `take`.
///
/// # Errors
/// Those of `take`.
pub(crate) fn in_order<I: Sync, T: Send, E>(
    items: &[I],
    make: impl Fn(&I) -> T + Sync,
    mut take: impl FnMut(&I, T) -> Result<(), E>,
) -> Result<(), E> {
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    let threads = threads.min(items.len());
    thread::scope(|scope| {
        let make = &make;
        let made: Vec<_> = (0..threads)
            .map(|first| {
                let (sender, receiver) = sync_channel(1);
                scope.spawn(move || {
                    for item in items.iter().skip(first).step_by(threads) {
                        if sender.send(make(item)).is_err() {
                            // Nobody listens any more.
                            break;
                        }
                    }
                });
                receiver
            })
            .collect();
        for (index, item) in items.iter().enumerate() {
            match made[index % threads].recv() {
                Ok(result) => take(item, result)?,
                // The thread has panicked; the scope says so.
                Err(_) => break,
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_order_and_the_first_error_ends_it() {
        let items: Vec<u32> = (0..100).collect();
        let mut seen = Vec::new();
        let all: Result<(), u32> = in_order(
            &items,
            |&item| 2 * item,
            |&item, twice| {
                seen.push((item, twice));
                Ok(())
            },
        );
        assert_eq!(all, Ok(()));
        let wanted: Vec<_> = items.iter().map(|&item| (item, 2 * item)).collect();
        assert_eq!(seen, wanted);
        let failed = in_order(
            &items,
            |&item| if item % 7 == 6 { Err(item) } else { Ok(()) },
            |_, made| made,
        );
        assert_eq!(failed, Err(6));
        assert_eq!(in_order(&[0_u8; 0], |_| (), |_, ()| Err(())), Ok(()));
    }
}
