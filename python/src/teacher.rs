//! Teachers: a callable of Python, a network, or a folder of colored photos.

use std::path::{Path, PathBuf};

use gs_chroma::{
    capture::{Dataset, IMAGES, Orientation},
    chroma::{
        Colorizer, ColorizerError, ViewTarget,
        teacher::{self, AbImage, GrayImage, Query, TeacherSettings, Upsample},
    },
    color::srgb_to_lab,
};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::{
    arrays::{array, floats, kind, of_shape, shape_error},
    error::{TeacherError, python},
};

/// Beyond this no CIELAB a or b is.
const AB_MOST: f32 = 256.0;

/// RGB may be so far outside of 0 to 1: networks round.
const RGB_SLACK: f32 = 0.05;

/// Answers that stay as near to gray as this are not in CIELAB units, but from -1 to 1.
const UNIT: f32 = 2.0;

/// The longest side of an answer, in pixels.
const MOST: usize = 1 << 15;

/// Someone who colors photos.
pub enum Teacher {
    /// A callable of Python.
    Callable(Callable),
    /// A network or a folder.
    Path {
        /// The network or the folder.
        teacher: teacher::Teacher,
        /// True if it lacks photos that are trained on: then each image is hand-made work.
        partial: bool,
    },
}

/// A callable that colors photos.
pub struct Callable {
    call: Py<PyAny>,
    upsample: Upsample,
    /// How each view's photo becomes upright, in the order in which views come.
    upright: std::vec::IntoIter<Orientation>,
    /// The largest a or b of all answers.
    largest: f32,
}

impl Teacher {
    /// For the photos of a dataset.
    ///
    /// # Errors
    /// `TypeError` for what is neither callable nor a path, [`TeacherError`] of a path.
    pub fn open(
        teacher: &Bound<'_, PyAny>,
        dataset: &Dataset,
        settings: &TeacherSettings,
    ) -> PyResult<Self> {
        if teacher.is_callable() {
            let views = dataset.capture.views.iter();
            let upright: Vec<Orientation> = views.map(|view| view.stance.upright).collect();
            return Ok(Self::Callable(Callable {
                call: teacher.clone().unbind(),
                upsample: settings.upsample,
                upright: upright.into_iter(),
                largest: 0.0,
            }));
        }
        let path: PathBuf = teacher.extract()?;
        let path = match path == Path::new("photos") {
            true => dataset.capture.root.join(IMAGES),
            false => path,
        };
        let opened = teacher
            .py()
            .detach(|| teacher::Teacher::open(&path, None, settings));
        let mut opened = python(opened)?;
        opened.know(&dataset.capture);
        let mut partial = false;
        for &view in &dataset.split.train {
            let query = Query::view(&dataset.capture.views[view], &dataset.cameras[view]);
            partial |= !python(opened.covers(query))?;
        }
        Ok(Self::Path {
            teacher: opened,
            partial,
        })
    }

    /// Warnings about the answers, a line each.
    ///
    /// # Errors
    /// [`TeacherError`] where a folder's images show other photos.
    pub fn doubts(&self) -> PyResult<Vec<String>> {
        match self {
            Self::Callable(callable) if callable.largest <= UNIT => Ok(vec![format!(
                "the teacher's colors stay within {UNIT} units of gray: are they CIELAB a and b?"
            )]),
            Self::Callable(_) => Ok(Vec::new()),
            Self::Path { teacher, .. } => {
                python(teacher.check_images())?;
                Ok([teacher.passed_over(), teacher.doubts()].concat())
            }
        }
    }
}

impl Colorizer for Teacher {
    fn colorize(
        &mut self,
        query: Query<'_>,
        photo: GrayImage<'_>,
    ) -> Result<Option<ViewTarget>, ColorizerError> {
        match self {
            Self::Callable(callable) => {
                let answer = Python::attach(|py| callable.ask(py, query.name, photo));
                Ok(answer?.map(ViewTarget::from))
            }
            Self::Path { teacher, partial } => {
                let answer = Colorizer::colorize(teacher, query, photo)?;
                let by_hand = *partial;
                Ok(answer.map(|answer| ViewTarget { by_hand, ..answer }))
            }
        }
    }
}

impl Callable {
    /// The answer for a photo, which is shown upright.
    fn ask(
        &mut self,
        py: Python<'_>,
        name: &str,
        photo: GrayImage<'_>,
    ) -> PyResult<Option<AbImage>> {
        let upright = self.upright.next().unwrap_or_default();
        let size = [photo.width, photo.height];
        let [width, height] = upright.size(size);
        let gray = upright.turned(photo.pixels.to_vec(), 1, size);
        let gray = gray
            .into_iter()
            .map(|value| f32::from(value) / 255.0)
            .collect();
        let gray = of_shape::<f32>(py, gray, &[height as usize, width as usize])?;
        let answer = self.call.bind(py).call1((gray,))?;
        if answer.is_none() {
            return Ok(None);
        }
        let ab = self.colors(&format!("the teacher's answer for {name}"), &answer)?;
        let upsample = self.upsample;
        Ok(Some(py.detach(|| {
            ab.turned(upright.inverse()).upsampled(photo, upsample)
        })))
    }

    /// a and b of an answer: a and b themselves, or RGB.
    fn colors(&mut self, name: &str, answer: &Bound<'_, PyAny>) -> PyResult<AbImage> {
        let answer = array(answer)?;
        let bytes = kind(&answer)? == "u";
        let (shape, numbers) = floats(name, &answer)?;
        let wanted = "[height, width, 2] of a and b, or [height, width, 3] of RGB";
        let (ab, height, width): (Vec<[f32; 2]>, _, _) = match shape[..] {
            [height @ 1..=MOST, width @ 1..=MOST, 2] if !bytes => {
                (numbers.as_chunks().0.to_vec(), height, width)
            }
            [height @ 1..=MOST, width @ 1..=MOST, 3] => {
                let (white, slack) = if bytes {
                    (255.0, 0.0)
                } else {
                    (1.0, RGB_SLACK)
                };
                if numbers
                    .iter()
                    .any(|value| *value < -slack || *value > white + slack)
                {
                    let reason = format!("{name}: RGB is uint8, or floats from 0 to 1");
                    return Err(PyValueError::new_err(reason));
                }
                let pixels = numbers.as_chunks::<3>().0.iter();
                let ab = pixels.map(|rgb| {
                    let rgb = rgb.map(|value| f64::from((value / white).clamp(0.0, 1.0)));
                    let [_, a, b] = srgb_to_lab(rgb);
                    [a as f32, b as f32]
                });
                (ab.collect(), height, width)
            }
            [2 | 3, _, _] => {
                let wanted =
                    format!("{wanted}: move the channels behind, as permute(1, 2, 0) does");
                return Err(shape_error(name, &shape, &wanted));
            }
            _ => return Err(shape_error(name, &shape, wanted)),
        };
        let largest = ab
            .as_flattened()
            .iter()
            .fold(0.0, |most: f32, value| most.max(value.abs()));
        if largest > AB_MOST {
            let reason = format!("{name}: no CIELAB a or b is {largest}");
            return Err(TeacherError::new_err(reason));
        }
        self.largest = self.largest.max(largest);
        Ok(AbImage {
            width: width as u32,
            height: height as u32,
            ab,
        })
    }
}
