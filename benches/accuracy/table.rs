//! Results as Markdown and as CSV.

use std::fmt::Write;

use serde::Serialize;

use crate::{error::Error, knobs::Knob, time::Time, training::Fit};

/// Results of one value of one knob.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the subject.
    pub subject: String,
    /// The knob.
    pub knob: &'static str,
    /// Its value.
    pub value: &'static str,
    /// Against the oracle.
    pub error: Error,
    /// Against the default.
    pub time: Time,
    /// Distance of the trained parameters from the default's.
    pub drift: Option<f64>,
    /// Whole trainings.
    pub fit: Option<Fit>,
}

impl Row {
    /// A row without trainings.
    pub fn new(subject: &str, knob: Knob, error: Error, time: Time) -> Self {
        Self {
            subject: subject.to_owned(),
            knob: knob.key,
            value: knob.value,
            error,
            time,
            drift: None,
            fit: None,
        }
    }

    /// The stage whose time changed most, and by how much.
    fn most(&self) -> Option<(&'static str, f64)> {
        let changed = |ratio: f64| ratio.ln().abs();
        (self.time.stages.iter())
            .map(|(&stage, &ratio)| (stage, ratio))
            .max_by(|(_, a), (_, b)| changed(*a).total_cmp(&changed(*b)))
    }
}

/// A table a subject.
pub fn markdown(rows: &[Row]) -> String {
    let mut text = String::new();
    let mut subject = "";
    for row in rows {
        if row.subject != subject {
            subject = &row.subject;
            // Writing to a string cannot fail.
            let _ = write!(
                text,
                "\n{subject}, an iteration of {:.0} ms\n\n\
                 | knob | value | worst pixel, levels | RMS, levels | gradient | time | quartiles | most in | drift | PSNR | training, s |\n\
                 |---|---|--:|--:|--:|--:|--:|---|--:|--:|--:|\n",
                row.time.milliseconds
            );
        }
        let Error {
            picture_max,
            picture_rms,
            gradient,
        } = row.error;
        let [low, high] = row.time.quartiles;
        let most = row.most().map_or(String::new(), |(stage, ratio)| {
            format!("{stage} {ratio:.2}")
        });
        let drift = row
            .drift
            .map_or(String::new(), |drift| format!("{drift:.3}"));
        let fit = row.fit.map_or(" | ".to_owned(), |fit| {
            format!("{:.2} | {:.1}", fit.psnr, fit.seconds)
        });
        let _ = writeln!(
            text,
            "| {} | {} | {picture_max:.4} | {picture_rms:.5} | {gradient:.1e} | {:.3} | {low:.2} to {high:.2} | {most} | {drift} | {fit} |",
            row.knob, row.value, row.time.ratio,
        );
    }
    text
}

/// One line a row; what was not measured is empty.
pub fn csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "subject,knob,value,picture_max,picture_rms,gradient,time,time_low,time_high,\
         milliseconds,lists,blending,loss,adjoint,steps,drift,psnr,seconds\n",
    );
    for row in rows {
        let (error, time) = (&row.error, &row.time);
        let stages: String = ["lists", "blending", "loss", "adjoint", "steps"]
            .map(|stage| format!(",{:.4}", time.stages[stage]))
            .concat();
        let or_empty = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.5}"));
        let _ = writeln!(
            text,
            "{},{},\"{}\",{:.3e},{:.3e},{:.3e},{:.4},{:.4},{:.4},{:.3}{stages},{},{},{}",
            row.subject,
            row.knob,
            row.value,
            error.picture_max,
            error.picture_rms,
            error.gradient,
            time.ratio,
            time.quartiles[0],
            time.quartiles[1],
            time.milliseconds,
            or_empty(row.drift),
            or_empty(row.fit.map(|fit| fit.psnr)),
            or_empty(row.fit.map(|fit| fit.seconds)),
        );
    }
    text
}
