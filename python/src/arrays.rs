//! Arrays of NumPy, and of whoever can become one.

use numpy::{IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

/// Anything that NumPy takes as an array; PyTorch's tensors leave graph and device.
pub fn array<'py>(value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let numpy = value.py().import("numpy")?;
    if value.hasattr("detach")? && value.hasattr("cpu")? {
        let tensor = value.call_method0("detach")?.call_method0("cpu")?;
        return numpy.call_method1("asarray", (tensor.call_method0("numpy")?,));
    }
    numpy.call_method1("asarray", (value,))
}

/// The letter of an array's kind of numbers: `f` floats, `u` unsigned, …
pub fn kind(array: &Bound<'_, PyAny>) -> PyResult<String> {
    array.getattr("dtype")?.getattr("kind")?.extract()
}

/// Shape and numbers of an array, in the order of its axes.
///
/// # Errors
/// `TypeError` or `ValueError` of NumPy; `ValueError` for a number that is not finite.
pub fn floats(name: &str, value: &Bound<'_, PyAny>) -> PyResult<(Vec<usize>, Vec<f32>)> {
    let read: PyReadonlyArrayDyn<'_, f32> = contiguous(value, "float32")?;
    let numbers = read.as_slice()?.to_vec();
    check_finite(name, numbers.iter().all(|number| number.is_finite()))?;
    Ok((read.shape().to_vec(), numbers))
}

/// The same in double precision.
pub fn doubles(name: &str, value: &Bound<'_, PyAny>) -> PyResult<(Vec<usize>, Vec<f64>)> {
    let read: PyReadonlyArrayDyn<'_, f64> = contiguous(value, "float64")?;
    let numbers = read.as_slice()?.to_vec();
    check_finite(name, numbers.iter().all(|number| number.is_finite()))?;
    Ok((read.shape().to_vec(), numbers))
}

fn contiguous<'py, T: numpy::Element>(
    value: &Bound<'py, PyAny>,
    kind: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    let numpy = value.py().import("numpy")?;
    let options = PyDict::new(value.py());
    options.set_item("dtype", kind)?;
    let array = numpy.call_method("ascontiguousarray", (array(value)?,), Some(&options))?;
    Ok(array.cast::<PyArrayDyn<T>>()?.readonly())
}

fn check_finite(name: &str, finite: bool) -> PyResult<()> {
    match finite {
        true => Ok(()),
        false => Err(PyValueError::new_err(format!(
            "{name}: a number is not finite"
        ))),
    }
}

/// Refuses an array of another shape; `wanted` is what it may be, in words.
pub fn shape_error(name: &str, shape: &[usize], wanted: &str) -> PyErr {
    PyValueError::new_err(format!("{name}: the shape is {shape:?}, not {wanted}"))
}

/// Rows of `N` numbers.
///
/// # Errors
/// `ValueError` where the array is not `[rows, N]`.
pub fn rows<const N: usize>(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<[f32; N]>> {
    let (shape, numbers) = floats(name, value)?;
    match shape[..] {
        [_, columns] if columns == N => Ok(numbers.as_chunks().0.to_vec()),
        _ => Err(shape_error(name, &shape, &format!("[N, {N}]"))),
    }
}

/// `N` numbers in double precision.
///
/// # Errors
/// `ValueError` where the array is not of this shape.
pub fn exactly<const N: usize>(
    name: &str,
    value: &Bound<'_, PyAny>,
    shape: &[usize],
) -> PyResult<[f64; N]> {
    let (found, numbers) = doubles(name, value)?;
    let numbers = (found == shape).then(|| numbers.try_into().ok()).flatten();
    numbers.ok_or_else(|| shape_error(name, &found, &format!("{shape:?}")))
}

/// An array of NumPy that owns its numbers.
///
/// # Errors
/// `ValueError` where the numbers do not fill the shape.
pub fn of_shape<'py, T: numpy::Element>(
    py: Python<'py>,
    numbers: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    numbers.into_pyarray(py).reshape(shape.to_vec())
}
