//! How far an evaluation is.

/// What an evaluation is doing.
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

/// How far it is.
#[derive(Clone, Copy, Debug)]
pub struct Progress<'a> {
    /// What is being done.
    pub task: Task,
    /// Steps done.
    pub done: usize,
    /// Steps in all.
    pub total: usize,
    /// The view at hand, if it has a name.
    pub name: &'a str,
}

/// Who is told.
pub type Observer<'a> = dyn FnMut(Progress<'_>) + 'a;
