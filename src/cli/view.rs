//! `gs-chroma view`.

use std::{
    env,
    path::{Path, PathBuf},
    sync::Arc,
    thread,
};

use clap::Args;

use super::{CliError, headings::OUTPUT, interrupt, print, progress::Progress};
use crate::{
    paint::{PaintContent, PaintSession},
    run::ViewedScene,
    subject::Live,
    tell::Stage,
    view::{LiveContent, Request, Response, RunContent, Server, answer},
};

/// Show a run or a splat file in the browser, beside its photos.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma view runs/house
  gs-chroma view house.spz

Color by hand, with strokes on the photos:
  gs-chroma view runs/house --paint")]
pub struct View {
    /// Run folder or splat file [default: newest run under runs/].
    #[arg(value_name = "RUN|FILE")]
    run: Option<PathBuf>,
    /// COLMAP folder, if it has moved since fit.
    #[arg(long, value_name = "COLMAP_DIR")]
    colmap: Option<PathBuf>,
    /// Port on 127.0.0.1 [default: one that is free].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    port: Option<u16>,
    /// Print the address and open no browser.
    #[arg(long)]
    no_open: bool,
    /// Paint strokes on the photos of a run; the scene follows, and Save colors the run with them.
    #[arg(long)]
    paint: bool,
}

impl View {
    pub(super) fn run(self) -> Result<(), CliError> {
        let mut progress = Progress::through(vec![Stage::Model]);
        let (run, colmap) = (self.run.as_deref(), self.colmap.as_deref());
        let observe = &mut |event| progress.show(&event);
        if self.paint {
            let session = PaintSession::open(run, colmap, observe)?;
            let name = format!("{}, to be painted on", session.scene.viewed.name);
            let content = PaintContent::new(session);
            let server = Server::bind(self.port)?.taking();
            progress.finish();
            return self.serve(&server, &name, move |request| content.answer(request));
        }
        let viewed = ViewedScene::open(run, colmap, observe)?;
        let name = viewed.name.clone();
        let content = RunContent::new(viewed, observe)?;
        let server = Server::bind(self.port)?;
        progress.finish();
        self.serve(&server, &name, move |request| answer(&content, request))
    }

    fn serve(
        &self,
        server: &Server,
        name: &str,
        answer: impl Fn(&Request) -> Response + Send + Sync + 'static,
    ) -> Result<(), CliError> {
        let url = server.url();
        // Who reads the line may act on it at once.
        interrupt::ends_well();
        print(format_args!("{url} shows {name}; Ctrl-C ends it"))?;
        if !self.no_open {
            open(&url);
        }
        server.serve(answer);
        Ok(())
    }
}

/// Options of the live view.
#[derive(Args)]
pub(super) struct ViewArguments {
    /// Show the scene in the browser while it is made.
    #[arg(long, help_heading = OUTPUT)]
    view: bool,
    /// Port of the page on 127.0.0.1 [default: one that is free].
    #[arg(long, requires = "view", help_heading = OUTPUT, hide_short_help = true, value_parser = clap::value_parser!(u16).range(1..))]
    port: Option<u16>,
    /// Print the address and open no browser.
    #[arg(long, requires = "view", help_heading = OUTPUT, hide_short_help = true)]
    no_open: bool,
}

impl ViewArguments {
    /// Opens the page of the command that makes the run `folder`, if it is wanted.
    ///
    /// # Errors
    /// [`ViewerError::Port`](crate::view::ViewerError), before any work is done.
    pub fn begin(&self, folder: &Path) -> Result<Option<Arc<Live>>, CliError> {
        if !self.view {
            return Ok(None);
        }
        let server = Server::bind(self.port)?;
        let url = server.url();
        eprintln!("{url} shows the scene as it grows");
        let live = Arc::<Live>::default();
        let content = LiveContent::new(folder, live.clone());
        // Ends with the program.
        thread::spawn(move || server.serve(move |request| answer(&content, request)));
        if !self.no_open {
            open(&url);
        }
        Ok(Some(live))
    }
}

/// Opens a page in the browser, where there is a screen.
pub(super) fn open(url: &str) {
    let screens = ["DISPLAY", "WAYLAND_DISPLAY", "WSL_DISTRO_NAME"];
    let has_screen = !cfg!(target_os = "linux")
        || screens
            .iter()
            .any(|&name| env::var_os(name).is_some_and(|set| !set.is_empty()));
    // Where it cannot, the line above says what to open.
    if has_screen {
        let _ = open::that_detached(url);
    }
}
