//! A page that shows a scene: served to this machine's browser, or written as one file that
//! anybody can open. It draws with the kernel of [`crate::raster`], in WebGL 2.

mod about;
pub mod assets;
mod content;
mod html;
mod live;
mod overview;
mod packed;
mod server;

pub use content::{Content, RunContent, answer};
pub use html::{is_html, write_html};
pub use live::LiveContent;
pub use overview::overview;
pub use packed::pack;
pub use server::{Request, Response, Server};

use crate::{run::RunError, store::StoreError};

/// Error of showing a scene.
#[derive(Debug, thiserror::Error)]
pub enum ViewerError {
    /// The run or the file.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A file or a folder.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A port that is taken or not allowed.
    #[error("port {port} of 127.0.0.1 cannot be used ({reason})")]
    Port {
        /// Port on 127.0.0.1.
        port: u16,
        /// The system's reason.
        reason: String,
    },
    /// There is no such scene.
    #[error("{0}: has no scene to show")]
    Nothing(String),
}
