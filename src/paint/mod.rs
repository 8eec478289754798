//! Painting on the photos of a run, while the whole scene follows.
//!
//! A [`Stroke`](session::Stroke) goes onto the photo's [`Layer`](layer::Layer), which `colorize`
//! reads as a hint, and into the run's folder before anything else happens. Then a thread
//! [moves](crate::chroma::Repainter::paint) what it claims to its color, and
//! [solves](crate::chroma::Repainter::solve) for all colors from the last ones; whoever paints on ends
//! that. The run's own files stay until it is saved, which runs `colorize` itself.

mod command;
mod content;
mod free_view;
mod layer;
mod log;
mod pictures;
mod scene;
mod session;
mod strokes;
mod work;

pub use content::PaintContent;
pub use session::PaintSession;
