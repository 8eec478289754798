//! What a capture says about the effects of image formation that it calls for.

pub mod background;
#[cfg(test)]
mod fixtures;
pub mod sampling;
