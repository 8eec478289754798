//! A view at one scale, and its tile lists.

use crate::raster::{Lists, ViewUniform};

/// One view at one scale.
pub(super) struct Frozen {
    pub uniform: ViewUniform,
    pub visible: usize,
    /// Entries of its tile lists.
    pub entries: usize,
    /// Its own tile lists, made already.
    pub lists: Option<Lists>,
}
