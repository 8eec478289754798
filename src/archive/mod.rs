//! Parts of archives' formats: time codes, numbered pictures, DPX.

pub(crate) mod dpx;
mod numbered;
mod timecode;

pub(crate) use numbered::NumberedName;
pub(crate) use timecode::Timecode;
