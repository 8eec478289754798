//! A run's folder on the disk: its files, who may write them, and what a command goes on from.

pub(crate) mod checkpoints;
pub(crate) mod codec;
pub(crate) mod commit;
mod entries;
mod error;
pub(crate) mod files;
pub(crate) mod film;
pub(crate) mod fingerprint;
pub(crate) mod folder;
pub(crate) mod formats;
pub(crate) mod lock;
pub(crate) mod log;
pub(crate) mod originals;
mod picture_names;

pub use checkpoints::{CheckpointOptions, EVERY, Interrupt};
pub use codec::{Codec, is_film};
pub use error::StoreError;
pub use folder::RunFolder;
pub(crate) use picture_names::{distinct, picture_names};
