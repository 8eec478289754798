//! The photos themselves in color: each photo's own lightness, at its full size and depth, with
//! the colors that the scene has from where it was taken.
//!
//! A [`Canvas`] is a photo at working size. [`SceneDrawer`] says which colors the scene has there
//! and how far they can be believed; [`blend`] joins them with what the teacher says of the rest
//! and with the photo before, along the photo's edges; [`Strokes`] are what somebody painted on
//! the rest; [`Between`] carries colors to photos without a pose; [`finish`] brings them to full size.

mod align;
mod between;
mod blend;
mod canvas;
mod finish;
mod painted;
mod scene;
mod steady;
mod window;

pub use between::{Between, ColoredPhoto};
pub use blend::{WeightedColors, blend};
pub use canvas::Canvas;
pub use finish::{Colored, finish};
pub use painted::Strokes;
pub use scene::{SceneDrawer, ViewOf, believable, places};
pub use steady::{Steadied, steady};
