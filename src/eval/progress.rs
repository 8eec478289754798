//! Progress of an evaluation.

/// Task of an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Asking the teacher.
    Teacher,
    /// Coloring the scene in another way to compare with.
    Peer,
    /// Measuring pictures against their photos.
    Measure,
    /// Drawing and comparing the frames of a path.
    Path,
    /// Drawing the photographed views.
    Views,
    /// Comparing them with each other.
    Pairs,
    /// Measuring how strong the teacher's colors are.
    Strength,
}

/// Progress within a task.
#[derive(Clone, Copy, Debug)]
pub struct Progress<'a> {
    /// Task in progress.
    pub task: Task,
    /// Steps done.
    pub done: usize,
    /// Steps in all.
    pub total: usize,
    /// The view at hand, if it has a name.
    pub name: &'a str,
}

/// Receiver of progress.
pub type Observer<'a> = dyn FnMut(Progress<'_>) + 'a;
