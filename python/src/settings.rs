//! Settings in keywords, in the place of the library's defaults.

use pyo3::{
    exceptions::{PyTypeError, PyValueError},
    prelude::*,
    types::{PyCFunction, PyDict, PyString, PyTuple},
};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Map, Value};

/// `defaults` with the values of `keywords` in their place, by the names that reports have.
///
/// # Errors
/// `TypeError` for an unknown keyword, `ValueError` for a value that is none of its setting.
pub fn overlaid<T: Serialize + DeserializeOwned>(
    defaults: &T,
    keywords: Option<&Bound<'_, PyDict>>,
) -> PyResult<T> {
    let unreadable = |error: serde_json::Error| PyValueError::new_err(error.to_string());
    let Value::Object(mut settings) = serde_json::to_value(defaults).map_err(unreadable)? else {
        return Err(PyTypeError::new_err("these settings have no names"));
    };
    let known: Vec<String> = settings.keys().cloned().collect();
    if let Some(keywords) = keywords {
        for (name, value) in of_python::<Map<String, Value>>(keywords)? {
            let before = settings.insert(name.clone(), value);
            let read = serde_json::from_value::<T>(Value::Object(settings.clone()));
            // Of those that JSON leaves out while they are null there is no default.
            let taken = match (&read, &before) {
                (Ok(read), None) => serde_json::to_value(read)
                    .map_err(unreadable)?
                    .get(&name)
                    .is_some(),
                (_, before) => before.is_some(),
            };
            if !taken {
                let known = known.join(", ");
                let reason = format!("there is no setting {name}; there are {known}");
                return Err(PyTypeError::new_err(reason));
            }
            if let Err(error) = read {
                let before = before.unwrap_or_default();
                let reason = format!("{name}: {error} [default: {before}]");
                return Err(PyValueError::new_err(reason));
            }
        }
    }
    serde_json::from_value(Value::Object(settings)).map_err(unreadable)
}

/// A value of Python's, by way of JSON.
pub fn of_python<T: DeserializeOwned>(value: &Bound<'_, PyAny>) -> PyResult<T> {
    let py = value.py();
    let options = PyDict::new(py);
    options.set_item("default", PyCFunction::new_closure(py, None, None, plain)?)?;
    let json = py.import("json")?;
    let text = json.call_method("dumps", (value,), Some(&options))?;
    let text = text.cast::<PyString>()?.to_str()?.to_owned();
    serde_json::from_str(&text).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// What JSON has no words for: NumPy's numbers and arrays, and paths.
fn plain(words: &Bound<'_, PyTuple>, _: Option<&Bound<'_, PyDict>>) -> PyResult<Py<PyAny>> {
    let value = words.get_item(0)?;
    let plain = match value.hasattr("tolist")? {
        true => value.call_method0("tolist")?,
        false => words.py().import("os")?.call_method1("fspath", (value,))?,
    };
    Ok(plain.unbind())
}

/// A value for Python, by way of JSON: dictionaries, lists, numbers, strings.
pub fn to_python<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value);
    let text = text.map_err(|error| PyValueError::new_err(error.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// Refuses a number out of its range.
pub fn within<T: PartialOrd + std::fmt::Display>(
    name: &str,
    value: T,
    [least, most]: [T; 2],
) -> PyResult<()> {
    // NaN fails the comparison.
    match value >= least && value <= most {
        true => Ok(()),
        false => Err(PyValueError::new_err(format!(
            "{name}: {value} is not from {least} to {most}"
        ))),
    }
}
