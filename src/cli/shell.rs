//! `gs-chroma completions` and `gs-chroma man`: what shells and `man` want to know.

use std::path::{Path, PathBuf};

use clap::{Args, Command};
use clap_complete::{Shell, generate};
use clap_mangen::Man;

use super::{CliError, print, print_as_is};
use crate::{disk, store::files};

/// Print a completion script for a shell.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma completions bash >> ~/.bash_completion")]
pub struct Completions {
    /// Shell to complete in.
    shell: Shell,
}

impl Completions {
    pub(super) fn run(self, mut program: Command) -> Result<(), CliError> {
        let mut script = Vec::new();
        generate(self.shell, &mut program, "gs-chroma", &mut script);
        print_as_is(String::from_utf8_lossy(&script).trim_end())
    }
}

/// Write man pages, one for each command.
#[derive(Args)]
#[command(after_long_help = "Example:
  gs-chroma man ~/.local/share/man/man1")]
pub struct ManPages {
    /// Folder for the pages.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

impl ManPages {
    pub(super) fn run(self, mut program: Command) -> Result<(), CliError> {
        program.build();
        disk::make_folder(&self.folder).map_err(files::at(&self.folder))?;
        let count = write(&program, "gs-chroma", &self.folder)?;
        print(format_args!(
            "wrote {count} man pages to {}",
            self.folder.display()
        ))
    }
}

/// Writes the page of a command and those of its subcommands; how many.
fn write(command: &Command, name: &str, folder: &Path) -> Result<usize, CliError> {
    let path = folder.join(format!("{name}.1"));
    let mut page = Vec::new();
    let named = command.clone().name(name.to_owned());
    Man::new(named)
        .render(&mut page)
        .map_err(files::at(&path))?;
    files::write(&path, &page)?;
    let others = command
        .get_subcommands()
        .filter(|other| other.get_name() != "help");
    others
        .map(|other| write(other, &format!("{name}-{}", other.get_name()), folder))
        .sum::<Result<usize, CliError>>()
        .map(|pages| pages + 1)
}
