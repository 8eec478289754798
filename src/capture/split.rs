//! Split into training and test views.

use super::{Chosen, View};

/// Every how many views one is held out, as in the LLFF and Mip-NeRF 360 benchmarks.
const HOLDOUT_STEP: usize = 8;

/// The fewest photos that can train a scene: depth needs two.
const MIN_TRAIN: usize = 2;

/// Indices of views for training and for testing, each ascending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Split {
    /// Views to train on.
    pub train: Vec<usize>,
    /// Views held out.
    pub test: Vec<usize>,
}

impl Split {
    /// Trains on some of the views that are held out.
    pub fn train_on(&mut self, some: impl Fn(usize) -> bool) {
        let (train, test) = self.test.iter().partition(|&&view| some(view));
        self.test = test;
        self.train.extend::<Vec<usize>>(train);
        self.train.sort_unstable();
    }
}

/// Splits views, sorted by photo: with `holdout`, photos 0, 8, 16, … test. Faces of
/// one photo stay together.
///
/// Without it, or where fewer than 2 photos would be left to train on, all train.
pub fn split(views: &[View], holdout: bool) -> Split {
    let photos: Vec<&[View]> = views.chunk_by(|a, b| a.photo == b.photo).collect();
    let by_photo = split_photos(photos.len(), holdout);
    let starts: Vec<usize> = (photos.iter())
        .scan(0, |next, faces| {
            Some(std::mem::replace(next, *next + faces.len()))
        })
        .collect();
    let views = |chosen: Vec<usize>| {
        let faces = |&i: &usize| starts[i]..starts[i] + photos[i].len();
        chosen.iter().flat_map(faces).collect()
    };
    Split {
        train: views(by_photo.train),
        test: views(by_photo.test),
    }
}

/// Splits views as it was chosen for their photos.
pub fn split_as(views: &[View], chosen: &Chosen) -> Split {
    let held_out = |&view: &usize| chosen.test.contains(&views[view].photo);
    let (test, train) = (0..views.len()).partition(held_out);
    Split { train, test }
}

fn split_photos(count: usize, holdout: bool) -> Split {
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
        let split = split_photos(18, true);
        assert_eq!(split.test, [0, 8, 16]);
        assert_eq!(split.train.len(), 15);
        assert!(split.train.iter().all(|i| !split.test.contains(i)));
    }

    #[test]
    fn held_out_views_may_be_trained_on() {
        let mut split = split_photos(18, true);
        split.train_on(|view| view == 8 || view == 3);
        assert_eq!(split.test, [0, 16]);
        assert_eq!((split.train.len(), split.train[7]), (16, 8));
    }

    #[test]
    fn all_train_when_asked_or_when_few() {
        assert_eq!(split_photos(18, false).train.len(), 18);
        assert!(split_photos(18, false).test.is_empty());
        for count in 0..=2 {
            assert_eq!(split_photos(count, true).train.len(), count);
            assert!(split_photos(count, true).test.is_empty());
        }
        assert_eq!(split_photos(3, true).train, [1, 2]);
    }
}
