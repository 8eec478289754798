//! Every kernel on random inputs against the oracle: one topic a file, one
//! [`Row`] a quantity. Bounds are the worst errors seen on Mesa 22.3's llvmpipe.

mod adam;
mod blend;
mod chroma_loss;
mod densify;
mod gradient;
mod lbfgs;
mod losses;
pub mod numerics;
mod project;
mod rgb_loss;
mod scan;
mod sort;
mod step;
mod view_correction;
mod viewer;

pub use chroma_loss::{ChromaInput, ChromaOutput};
pub use scan::{Scanned, scan_on};
pub use sort::sort_on;

use std::sync::Arc;

use super::measured::Row;
use crate::{gpu::GpuError, raster::Raster};

/// Measures a topic.
type Measure = fn(&Arc<Raster>) -> Result<Vec<Row>, GpuError>;

/// The topics in the order in which an iteration meets them.
pub const TOPICS: [(&str, Measure); 19] = [
    ("project", project::rows),
    ("scan", scan::rows),
    ("sort", sort::rows),
    ("blend", blend::rows),
    ("losses", losses::rows),
    ("chroma loss", chroma_loss::rows),
    ("rgb loss", rgb_loss::rgb_rows),
    ("lab loss", rgb_loss::lab_rows),
    ("adjoint", gradient::rows),
    ("numerics", numerics::rows),
    ("step", step::rows),
    ("adam", adam::rows),
    ("densify", densify::rows),
    ("view correction", view_correction::rows),
    ("lbfgs", lbfgs::rows),
    ("lbfgs held", lbfgs::held_rows),
    ("lbfgs judged", lbfgs::judged_rows),
    ("lbfgs to the end", lbfgs::end_rows),
    ("viewer", viewer::rows),
];
