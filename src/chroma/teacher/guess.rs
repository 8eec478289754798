//! Guess of a profile from the tensor shapes of an unknown model.

use super::model::{Element, Port, Ports};
use super::profile::{Layout, Role};

/// Profile of an unknown network as far as tensor shapes suggest it.
#[derive(Clone, Debug)]
pub(super) struct GuessedProfile {
    /// The first picture, and nothing for the others.
    pub inputs: Vec<Role>,
    /// Channels of that picture.
    pub image: usize,
    /// True if it consists of bytes.
    pub bytes: bool,
    /// Width and height where the model fixes them.
    pub fixed: [Option<u32>; 2],
    /// Channels of the answer.
    pub answer: usize,
    /// Name of the answer where there are several outputs.
    pub name: Option<String>,
}

impl GuessedProfile {
    /// This, or the largest power of two that goes into it and into the fixed sides.
    pub fn multiple(&self, most: u32) -> u32 {
        let sides = self.fixed.into_iter().flatten();
        sides.fold(most, |multiple, side| {
            multiple.min(1 << side.trailing_zeros())
        })
    }
}

impl Ports {
    /// The roles that inputs may have where nobody says so, the channels of the photo and of the
    /// answer: the first picture of one or three channels, and the first answer of two or three.
    /// None where there are no such.
    pub fn guess(&self, layout: Layout) -> Option<GuessedProfile> {
        let channels = |port: &Port, among: [usize; 2]| {
            let is_it = |&count: &usize| port.image(count, layout).is_some();
            among.into_iter().find(is_it)
        };
        let image = (self.inputs.iter()).position(|port| channels(port, [3, 1]).is_some())?;
        let answer = (self.outputs.iter()).position(|port| channels(port, [2, 3]).is_some())?;
        let role = |(i, port): (usize, &Port)| match port.element {
            _ if i == image => Role::Image,
            Element::I64 | Element::I32 => Role::Class,
            _ => Role::Zeros,
        };
        Some(GuessedProfile {
            inputs: self.inputs.iter().enumerate().map(role).collect(),
            image: channels(&self.inputs[image], [3, 1])?,
            bytes: self.inputs[image].element == Element::U8,
            fixed: self.inputs[image].image(channels(&self.inputs[image], [3, 1])?, layout)?,
            answer: channels(&self.outputs[answer], [2, 3])?,
            name: (self.outputs.len() > 1).then(|| self.outputs[answer].name.clone()),
        })
    }
}
