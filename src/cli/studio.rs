//! `gs-chroma studio`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, interrupt, print, view::open};
use crate::{
    studio::{Studio, StudioContent},
    view::Server,
};

/// Make, view and paint runs from a page in the browser.
///
/// The page starts these commands, shows how far they are, and hands out what they made. Nothing
/// leaves this machine.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma studio
  gs-chroma studio films/")]
pub struct StudioCommand {
    /// Folder of runs, new ones in runs/ below it.
    #[arg(value_name = "DIR", default_value = ".")]
    folder: PathBuf,
    /// Port on 127.0.0.1 [default: one that is free].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    port: Option<u16>,
    /// Print the address and open no browser.
    #[arg(long)]
    no_open: bool,
}

impl StudioCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        let studio = Studio::open(&self.folder)?;
        let server = Server::bind(self.port)?.taking();
        let (url, folder) = (server.url(), studio.folder().display());
        interrupt::ends_well();
        print(format_args!("{url} shows {folder}; Ctrl-C ends it"))?;
        if !self.no_open {
            open(&url);
        }
        let content = StudioContent(studio.clone());
        server.serve(move |request| content.answer(request));
        Ok(())
    }
}
