//! Match of a model to a profile: its inputs and outputs against the profiles' contracts.

use super::TeacherError;
use super::profile::{BUILT_IN, BuiltIn, Layout, MAX_SIDE, Profile, Role};
use ort::session::Session;
use ort::value::{Outlet, TensorElementType, ValueType};
use std::path::Path;

/// Type of a tensor's elements, as far as it matters here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Element {
    F32,
    F16,
    U8,
    I64,
    I32,
    Other,
}

impl Element {
    /// Returns true if an image can consist of it.
    fn is_number(self) -> bool {
        matches!(self, Self::F32 | Self::F16 | Self::U8)
    }
}

/// More pictures at once than any export asks for.
const MAX_BATCH: i64 = 64;

/// An input or output of a model.
#[derive(Clone, Debug)]
pub(super) struct Port {
    pub name: String,
    pub element: Element,
    /// Sides, -1 where left open.
    pub shape: Vec<i64>,
    /// All of it in words.
    words: String,
}

/// Inputs and outputs of a model.
#[derive(Clone, Debug)]
pub(super) struct Ports {
    pub inputs: Vec<Port>,
    pub outputs: Vec<Port>,
}

/// Assignment of a model's inputs and outputs to a profile.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Fit {
    /// Role of each of the model's inputs, in the model's order.
    pub roles: Vec<Role>,
    /// Width and height of the model's image where it fixes them.
    pub fixed: [Option<u32>; 2],
    /// Number of images that the model takes at once.
    pub batch: usize,
    /// Index of the model's output that is the answer.
    pub answer: usize,
}

impl Ports {
    pub fn of(session: &Session) -> Self {
        let ports = |outlets: &[Outlet]| outlets.iter().map(Port::of).collect();
        Self {
            inputs: ports(session.inputs()),
            outputs: ports(session.outputs()),
        }
    }

    /// Inputs and outputs in words.
    pub fn describe(&self) -> String {
        let all = |ports: &[Port]| {
            let words: Vec<_> = ports.iter().map(|port| port.words.as_str()).collect();
            words.join(", ")
        };
        let (inputs, outputs) = (all(&self.inputs), all(&self.outputs));
        format!("inputs {inputs} and outputs {outputs}")
    }

    fn has_names(&self, names: &[&str]) -> bool {
        let mut own: Vec<_> = self.inputs.iter().chain(&self.outputs).collect();
        own.retain(|port| !names.contains(&port.name.as_str()));
        own.is_empty() && self.inputs.len() + self.outputs.len() == names.len()
    }

    /// Fit of a profile; none if it does not fit.
    ///
    /// An input goes to the first role that it can play and that no other has.
    pub fn fit(&self, profile: &Profile) -> Option<Fit> {
        let answer = match &profile.answer {
            Some(name) => self.outputs.iter().position(|port| port.name == *name)?,
            None => (self.outputs.len() == 1).then_some(0)?,
        };
        self.outputs[answer].image(profile.output.channels(), profile.layout)?;
        let mut left: Vec<Option<Role>> = profile.inputs.iter().copied().map(Some).collect();
        let mut fit = Fit {
            roles: Vec::new(),
            fixed: [None; 2],
            batch: 1,
            answer,
        };
        for input in &self.inputs {
            let plays =
                |slot: &&mut Option<Role>| slot.is_some_and(|role| input.plays(role, profile));
            let role = left.iter_mut().find(plays)?.take()?;
            if role == Role::Image {
                fit.fixed = input.image(profile.image.channels(), profile.layout)?;
                fit.batch = usize::try_from(input.shape[0]).unwrap_or(1);
            }
            fit.roles.push(role);
        }
        let multiple = |side: u32| side.is_multiple_of(profile.size_multiple);
        let fits = left.iter().all(Option::is_none)
            && fit.fixed.iter().flatten().all(|&side| multiple(side));
        fits.then_some(fit)
    }

    /// Returns true if input and output have the ratio of sides of a kind of network, as far as the
    /// model fixes both.
    fn has_stride(&self, fit: &Fit, profile: &Profile, stride: u32) -> bool {
        let answer = self.outputs[fit.answer]
            .image(profile.output.channels(), profile.layout)
            .unwrap_or_default();
        let mut sides = fit.fixed.into_iter().zip(answer);
        sides.all(|sides| match sides {
            (Some(input), Some(output)) => input == output * stride,
            _ => true,
        })
    }

    /// The built-in profile that describes the model: by shapes, where several
    /// fit by the ratio of sides, and then by names.
    ///
    /// # Errors
    /// [`TeacherError::NoProfile`] where none does,
    /// [`TeacherError::SeveralProfiles`] where more than one might.
    pub fn choose(&self, path: &Path) -> Result<(Profile, Fit), TeacherError> {
        let mut fitting = Vec::new();
        for built_in in BUILT_IN {
            let profile = built_in.profile()?;
            if let Some(fit) = self.fit(&profile) {
                fitting.push((built_in, profile, fit));
            }
        }
        // Sides tell more than names, which an exporter may have made up.
        keep_if_any(&mut fitting, |(kind, profile, fit)| {
            self.has_stride(fit, profile, kind.stride)
        });
        keep_if_any(&mut fitting, |(kind, ..)| self.has_names(kind.tensors));
        if fitting.len() > 1 {
            let names: Vec<_> = fitting.iter().map(|(kind, ..)| kind.names[0]).collect();
            return Err(TeacherError::SeveralProfiles {
                path: path.to_path_buf(),
                profiles: names.join(" or "),
            });
        }
        let chosen = fitting.pop().map(|(_, profile, fit)| (profile, fit));
        chosen.ok_or_else(|| self.unknown(path))
    }

    /// Fit of the given profile.
    ///
    /// # Errors
    /// [`TeacherError::NoProfile`] where it does not.
    pub fn check(&self, path: &Path, profile: &Profile) -> Result<Fit, TeacherError> {
        let fit = self.fit(profile);
        fit.ok_or_else(|| self.no_profile(path, [profile.clone()].into_iter()))
    }

    /// Error of a model that no built-in profile fits.
    pub fn unknown(&self, path: &Path) -> TeacherError {
        self.no_profile(path, BUILT_IN.iter().flat_map(BuiltIn::profile))
    }

    fn no_profile(&self, path: &Path, profiles: impl Iterator<Item = Profile>) -> TeacherError {
        let accepted: Vec<_> = profiles.map(|profile| accepted(&profile)).collect();
        let which = match self.outputs.len() {
            0 | 1 => "",
            _ => " (a manifest says with answer = \"NAME\" which of them counts)",
        };
        TeacherError::NoProfile {
            path: path.to_path_buf(),
            found: self.describe() + which,
            accepted: accepted.join("; "),
        }
    }
}

impl Port {
    fn of(outlet: &Outlet) -> Self {
        let name = outlet.name().to_owned();
        match outlet.dtype() {
            ValueType::Tensor { ty, shape, .. } => Self {
                words: format!("{name} {ty:?} {}", shape_in_words(shape)),
                element: match ty {
                    TensorElementType::Float32 => Element::F32,
                    TensorElementType::Float16 => Element::F16,
                    TensorElementType::Uint8 => Element::U8,
                    TensorElementType::Int64 => Element::I64,
                    TensorElementType::Int32 => Element::I32,
                    _ => Element::Other,
                },
                shape: shape.to_vec(),
                name,
            },
            other => Self {
                words: format!("{name} ({other:?})"),
                element: Element::Other,
                shape: Vec::new(),
                name,
            },
        }
    }

    /// Width and height, where fixed, of a picture `[batch, channels, H, W]` or in the other
    /// layout; none where this is no such tensor.
    pub fn image(&self, channels: usize, layout: Layout) -> Option<[Option<u32>; 2]> {
        let [batch, own, height, width] = layout.sides(self.shape[..].try_into().ok()?);
        let batches = batch == -1 || (1..=MAX_BATCH).contains(&batch);
        let fits = own == -1 || own == channels as i64;
        let is_image = self.element.is_number() && batches && fits;
        let side = |side: i64| match side {
            -1 => Some(None),
            side => Some(Some(
                u32::try_from(side)
                    .ok()
                    .filter(|s| (1..=MAX_SIDE).contains(s))?,
            )),
        };
        is_image.then_some(())?;
        Some([side(width)?, side(height)?])
    }

    fn is_image(&self, channels: usize, profile: &Profile) -> bool {
        self.image(channels, profile.layout).is_some()
    }

    /// Returns true if this input can play a role.
    fn plays(&self, role: Role, profile: &Profile) -> bool {
        match role {
            Role::Image => self.is_image(profile.image.channels(), profile),
            Role::Hints => self.is_image(2, profile),
            Role::Mask => self.is_image(1, profile),
            Role::Class => {
                matches!(self.element, Element::I64 | Element::I32) && self.len().is_some()
            }
            Role::Noise | Role::Zeros => self.element.is_number() && self.len().is_some(),
        }
    }

    /// Number of elements, an open batch counting as 1; none if other sides are open or it is
    /// larger than any image.
    pub fn len(&self) -> Option<usize> {
        let most = 3 * i64::from(MAX_SIDE) * i64::from(MAX_SIDE);
        let product = self.closed().iter().try_fold(1_i64, |product, &side| {
            product.checked_mul(side).filter(|p| (1..=most).contains(p))
        });
        usize::try_from(product?).ok()
    }

    /// The shape with a batch of 1 where it is open.
    pub fn closed(&self) -> Vec<i64> {
        let mut shape = self.shape.clone();
        if let Some(batch) = shape.first_mut().filter(|batch| **batch == -1) {
            *batch = 1;
        }
        shape
    }
}

/// Keeps what a clue speaks for, or everything where it speaks for nothing.
fn keep_if_any<T>(found: &mut Vec<T>, clue: impl Fn(&T) -> bool) {
    if found.iter().any(&clue) {
        found.retain(clue);
    }
}

fn shape_in_words(shape: &[i64]) -> String {
    let side = |&side: &i64| match side {
        -1 => "?".to_string(),
        side => side.to_string(),
    };
    let sides: Vec<_> = shape.iter().map(side).collect();
    format!("[{}]", sides.join(","))
}

/// Description of the shapes that a profile accepts.
fn accepted(profile: &Profile) -> String {
    let inputs = profile.inputs.iter().map(|role| match role {
        Role::Image => format!("[1,{},H,W]", profile.image.channels()),
        Role::Hints => "[1,2,H,W]".to_owned(),
        Role::Mask => "[1,1,H,W]".to_owned(),
        Role::Class => "a class of integers".to_owned(),
        Role::Noise => "a code".to_owned(),
        Role::Zeros => "zeros".to_owned(),
    });
    let inputs = inputs.collect::<Vec<_>>().join(", ");
    let channels = profile.output.channels();
    format!("{} ({inputs} to [1,{channels},h,w])", profile.name)
}

#[cfg(test)]
mod tests {
    use super::super::profile::named;
    use super::*;

    fn port(name: &str, element: Element, shape: &[i64]) -> Port {
        Port {
            name: name.to_owned(),
            element,
            shape: shape.to_vec(),
            words: format!("{name} {}", shape_in_words(shape)),
        }
    }

    fn image(name: &str, channels: i64, side: i64) -> Port {
        port(name, Element::F32, &[1, channels, side, side])
    }

    fn ports(inputs: &[Port], output: Port) -> Ports {
        Ports {
            inputs: inputs.to_vec(),
            outputs: vec![output],
        }
    }

    fn chosen(inputs: &[Port], output: Port) -> Result<String, String> {
        let chosen = ports(inputs, output).choose(Path::new("m.onnx"));
        chosen
            .map(|(profile, _)| profile.name)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn shapes_and_then_names_decide() {
        let code = port("z", Element::F32, &[1, 119]);
        let class = port("c", Element::I64, &[1]);
        for (inputs, output, expected) in [
            (vec![image("x", 3, 512)], image("y", 2, 512), "DDColor"),
            (
                vec![image("x", 1, 256)],
                image("y", 2, 256),
                "ECCV16/SIGGRAPH17",
            ),
            (vec![image("x", 1, 224)], image("y", 2, 56), "Caffe v2"),
            (
                vec![image("input", 1, 224)],
                image("output", 2, 56),
                "Caffe v2",
            ),
            (vec![image("x", 3, 512)], image("y", 2, 256), "DDColor"),
            (
                vec![image("input", 1, -1)],
                image("output", 2, -1),
                "ECCV16/SIGGRAPH17",
            ),
            (
                vec![image("data_l", 1, -1)],
                image("class8_ab", 2, -1),
                "Caffe v2",
            ),
            (
                vec![image("x", 1, 256), image("h", 2, 256), image("m", 1, 256)],
                image("y", 2, 256),
                "SIGGRAPH17 with hints",
            ),
            (
                vec![image("x", 1, -1), code.clone(), class.clone()],
                image("y", 3, -1),
                "BigColor",
            ),
            (
                vec![class, image("x", 1, -1), code],
                image("y", 3, -1),
                "BigColor",
            ),
        ] {
            assert_eq!(chosen(&inputs, output).as_deref(), Ok(expected));
        }
    }

    #[test]
    fn where_two_fit_both_are_named() {
        for (inputs, output, expected) in [
            (
                image("input", 3, -1),
                image("output", 3, -1),
                "deoldify or deoldify-browser",
            ),
            (
                image("input", 3, 256),
                image("output", 3, 256),
                "deoldify or deoldify-browser",
            ),
            (
                image("x", 1, -1),
                image("y", 2, -1),
                "siggraph17 or caffe-v2",
            ),
        ] {
            let message = chosen(&[inputs], output).unwrap_err();
            for part in ["m.onnx", "only you can know", expected] {
                assert!(message.contains(part), "{message}");
            }
        }
    }

    #[test]
    fn what_fits_nothing() {
        for (inputs, output) in [
            (vec![], image("y", 2, 32)),
            (vec![image("x", 4, 32)], image("y", 2, 32)),
            (vec![image("x", 3, 32)], image("y", 5, 32)),
            (vec![image("x", 3, 9000)], image("y", 2, 9000)),
            (vec![image("x", 3, 0)], image("y", 2, 32)),
            (
                vec![port("x", Element::Other, &[1, 3, 32, 32])],
                image("y", 2, 32),
            ),
            (
                vec![image("x", 3, 32), image("w", 3, 32)],
                image("y", 2, 32),
            ),
            // No multiple of 32.
            (vec![image("x", 3, 100)], image("y", 3, 100)),
        ] {
            let message = chosen(&inputs, output).unwrap_err();
            assert!(
                message.contains("no known colorization network"),
                "{message}"
            );
            assert!(
                message.contains("DDColor ([1,3,H,W] to [1,2,h,w])"),
                "{message}"
            );
        }
    }

    #[test]
    fn a_profile_that_is_asked_for_has_to_fit() {
        let model = ports(&[image("x", 3, 64)], image("y", 3, 64));
        let path = Path::new("m.onnx");
        let fit = model.check(path, &named("deoldify").unwrap()).unwrap();
        assert_eq!(fit.fixed, [Some(64); 2]);
        let message = model
            .check(path, &named("ddcolor").unwrap())
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("m.onnx") && message.contains("[1,2,h,w]"),
            "{message}"
        );
        assert!(!message.contains("Caffe"), "{message}");
    }

    #[test]
    fn extra_inputs_need_a_size() {
        let open = port("z", Element::F32, &[1, -1]);
        let huge = port("z", Element::F32, &[1 << 40, 1 << 40]);
        let batch = port("z", Element::F32, &[-1, 119]);
        assert_eq!(
            (open.len(), huge.len(), batch.len()),
            (None, None, Some(119))
        );
    }
}
