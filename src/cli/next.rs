//! Suggestions of the next command.

use std::path::Path;

use crate::{invocation::Invocation, tradeoff::shell_line as line};

/// `fit` with the options that `plan` was given.
pub(super) fn fit_as_planned() -> String {
    let given = Invocation::present().arguments.iter().skip(1);
    let given = given.map(|word| word.to_string_lossy().into_owned());
    line(
        &["fit".to_owned()]
            .into_iter()
            .chain(given)
            .collect::<Vec<_>>(),
    )
}

/// `fit` of a COLMAP folder.
pub(super) fn fit(colmap_dir: &Path) -> String {
    let dir = colmap_dir.to_string_lossy();
    // An option is not what is meant.
    match dir.starts_with('-') {
        true => line(&["fit", &format!("./{dir}")]),
        false => line(&["fit", &dir]),
    }
}

/// `colorize` by a teacher that only the user can name.
pub(super) fn colorize(run: &Path) -> String {
    format!(
        "{}\n      (gs-chroma teacher list shows the names)",
        line(&["colorize", &run.to_string_lossy(), "--teacher", "NAME"])
    )
}

/// `eval` of a run.
pub(super) fn eval(run: &Path) -> String {
    line(&["eval", &run.to_string_lossy()])
}

/// `frames` of a run.
pub(super) fn frames(run: &Path) -> String {
    line(&["frames", &run.to_string_lossy(), "-o", "colored"])
}

/// `auto` with a teacher, of photos that only the user can name.
pub(super) fn auto(teacher: &str) -> String {
    line(&["auto", "PHOTOS", "--teacher", teacher, "-o", "out"])
}

/// `teacher fetch` of a network.
pub(super) fn fetch(name: &str) -> String {
    line(&["teacher", "fetch", name])
}

/// `teacher list`.
pub(super) fn teachers() -> String {
    line(&["teacher", "list"])
}

/// `export` of a run, of the newest by default.
pub(super) fn export(run: Option<&Path>) -> String {
    let run = run.map(Path::to_string_lossy);
    let mut words = vec!["export"];
    words.extend(run.as_deref());
    words.extend(["-o", "scene.ply"]);
    line(&words)
}

/// The page of a run or a splat file.
pub(super) fn see(scene: &Path) -> String {
    line(&["view", &scene.to_string_lossy()])
}

/// A page to look at.
pub(super) fn look(page: &Path) -> String {
    format!("open {} in a browser", page.display())
}

/// A splat file to look at.
pub(super) fn view(ply: &Path) -> String {
    format!(
        "open {} in a viewer of splats, such as SuperSplat",
        ply.display()
    )
}
