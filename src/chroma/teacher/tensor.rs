//! Numbers as ONNX Runtime takes and gives them.

use super::error::first_line;
use super::model::Element;
use super::profile::Layout;
use half::f16;
use ort::session::SessionInputValue;
use ort::value::{DynValue, Tensor, TensorElementType};

/// A picture for a network, `[channels, height, width]`.
pub(super) struct NetworkImage {
    /// Axis order of the network's input.
    pub layout: Layout,
    /// Number of copies that the network takes at once.
    pub batch: usize,
    /// Width and height.
    pub size: [u32; 2],
    pub values: Vec<f32>,
}

impl NetworkImage {
    /// The picture as a tensor, so many times over.
    pub fn tensor(self, element: Element) -> Result<SessionInputValue<'static>, String> {
        let [width, height] = self.size.map(|side| side as usize);
        let pixels = width * height;
        let channels = self.values.len() / pixels.max(1);
        let mut values = vec![0.0; self.values.len()];
        for (i, value) in self.values.into_iter().enumerate() {
            let to = (self.layout).index(i / pixels, i % pixels, [channels, pixels]);
            values[to] = value;
        }
        let shape = [self.batch, channels, height, width].map(|side| side as i64);
        of(
            element,
            self.layout.shape(shape).to_vec(),
            values.repeat(self.batch),
        )
    }
}

/// A tensor of numbers, which are rounded where the element is an integer.
pub(super) fn of(
    element: Element,
    shape: Vec<i64>,
    values: Vec<f32>,
) -> Result<SessionInputValue<'static>, String> {
    macro_rules! tensor {
        ($convert:expr) => {
            Tensor::from_array((shape, values.into_iter().map($convert).collect::<Vec<_>>()))
                .map(SessionInputValue::from)
        };
    }
    let tensor = match element {
        Element::F32 => Tensor::from_array((shape, values)).map(SessionInputValue::from),
        Element::F16 => tensor!(f16::from_f32),
        // Casts saturate.
        Element::U8 => tensor!(|value| value.round() as u8),
        Element::I64 => tensor!(|value| value as i64),
        Element::I32 => tensor!(|value| value as i32),
        Element::Other => return Err("it takes numbers of an unknown type".to_owned()),
    };
    tensor.map_err(first_line)
}

/// Shape and numbers of an output.
pub(super) fn read(value: &DynValue) -> Result<(Vec<i64>, Vec<f32>), String> {
    let kind = value.dtype().tensor_type();
    macro_rules! numbers {
        ($element:ty, $convert:expr) => {{
            let (shape, values) = value.try_extract_tensor::<$element>().map_err(first_line)?;
            (shape.to_vec(), values.iter().map($convert).collect())
        }};
    }
    Ok(match kind {
        Some(TensorElementType::Float16) => numbers!(f16, |value| value.to_f32()),
        Some(TensorElementType::Uint8) => numbers!(u8, |&value| f32::from(value)),
        _ => numbers!(f32, |&value| value),
    })
}
