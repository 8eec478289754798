//! How the values of options are read.

use std::str::FromStr;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde::Serialize;

use crate::run::Preset;

/// The presets with their help.
pub(super) const PRESETS: &[(Preset, &str)] = &[
    (
        Preset::Draft,
        "A look at photos and poses: 700 iterations, 12,000 Gaussians, 400 px, no SH",
    ),
    (
        Preset::Balanced,
        "Everyday use on a GPU: 3,500 iterations, 2,000,000 Gaussians, 1,600 px; stops early below 0.3 dB",
    ),
    (
        Preset::Paper,
        "The last tenths of a dB, as in the ChromaDistill paper: 15,000 iterations, 3,000,000 Gaussians, full size; stops early below 0.1 dB",
    ),
];

/// One of these, by the name that it has in reports; each with its help.
pub(super) fn one_of<T>(
    choices: &'static [(T, &'static str)],
) -> impl TypedValueParser<Value = T> + use<T>
where
    T: Copy + Serialize + Send + Sync + 'static,
{
    let values = choices
        .iter()
        .map(|(value, help)| PossibleValue::new(name(value)).help(*help));
    PossibleValuesParser::new(values).try_map(|text| {
        let chosen = choices.iter().find(|(value, _)| name(value) == text);
        chosen.map(|(value, _)| *value).ok_or("no such choice")
    })
}

/// The name of a value in reports.
fn name(value: &impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(name)) => name,
        _ => String::new(),
    }
}

/// A finite number above 0.
pub(super) fn positive<T>(text: &str) -> Result<T, String>
where
    T: FromStr + Copy + Into<f64>,
{
    let number = text.parse().ok();
    let number = number.filter(|&number: &T| number.into() > 0.0 && number.into().is_finite());
    number.ok_or_else(|| "must be a number above 0".to_owned())
}

/// A number from 0 to 1.
pub(super) fn share<T>(text: &str) -> Result<T, String>
where
    T: FromStr + Copy + Into<f64>,
{
    let number = text.parse().ok();
    let number = number.filter(|&number: &T| (0.0..=1.0).contains(&number.into()));
    number.ok_or_else(|| "must be a number from 0 to 1".to_owned())
}

/// Frames a second: numerator and denominator, both positive.
#[derive(Clone, Copy)]
pub(super) struct Rate(pub [u32; 2]);

/// Frames a second, whole or as a fraction.
pub(super) fn rate(text: &str) -> Result<Rate, String> {
    let (frames, seconds) = text.split_once('/').unwrap_or((text, "1"));
    let number = |text: &str| text.trim().parse().ok().filter(|&n: &u32| n > 0);
    match (number(frames), number(seconds)) {
        (Some(frames), Some(seconds)) => Ok(Rate([frames, seconds])),
        _ => Err("no rate: 24, 25 or 30000/1001".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_bounds() {
        assert_eq!(positive("0.5"), Ok(0.5_f32));
        for text in ["0", "-1", "inf", "nan", "", "1 s"] {
            assert!(positive::<f64>(text).is_err(), "{text}");
        }
        assert_eq!([share("0"), share("1.0")], [Ok(0.0_f64), Ok(1.0)]);
        for text in ["-0.1", "1.1", "nan", "half"] {
            assert!(share::<f64>(text).is_err(), "{text}");
        }
    }

    #[test]
    fn choices_are_read_by_their_names_in_reports() {
        let command = clap::Command::new("program")
            .arg(clap::Arg::new("preset").value_parser(one_of(PRESETS)));
        for preset in Preset::ALL {
            let read = command.clone().get_matches_from(["program", preset.name()]);
            assert_eq!(read.get_one("preset"), Some(&preset));
        }
        let refused = command.try_get_matches_from(["program", "drafty"]);
        let message = refused.map(|_| ()).unwrap_err().to_string();
        assert!(message.contains("draft, balanced, paper"), "{message}");
    }
}
