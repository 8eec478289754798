//! Which views train and which test.

/// Every how many views one is held out, as in the LLFF and Mip-NeRF 360 benchmarks.
const HOLDOUT_STEP: usize = 8;

/// The fewest views that can train a scene: depth needs two.
const MIN_TRAIN: usize = 2;

/// Indices of views for training and for testing, each ascending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Split {
    /// Views to train on.
    pub train: Vec<usize>,
    /// Views held out.
    pub test: Vec<usize>,
}

/// Splits `count` views, sorted by name: with `holdout`, views 0, 8, 16, … test.
///
/// Without it, or where fewer than 2 views would be left to train on, all train.
pub fn split(count: usize, holdout: bool) -> Split {
    let (test, train): (Vec<_>, Vec<_>) =
        (0..count).partition(|index| holdout && index % HOLDOUT_STEP == 0);
    if train.len() < MIN_TRAIN {
        Split {
            train: (0..count).collect(),
            test: Vec::new(),
        }
    } else {
        Split { train, test }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_eighth_is_held_out() {
        let split = split(18, true);
        assert_eq!(split.test, [0, 8, 16]);
        assert_eq!(split.train.len(), 15);
        assert!(split.train.iter().all(|i| !split.test.contains(i)));
    }

    #[test]
    fn all_train_when_asked_or_when_few() {
        assert_eq!(split(18, false).train.len(), 18);
        assert!(split(18, false).test.is_empty());
        for count in 0..=2 {
            assert_eq!(split(count, true).train.len(), count);
            assert!(split(count, true).test.is_empty());
        }
        assert_eq!(split(3, true).train, [1, 2]);
    }
}
