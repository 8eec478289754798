//! Decisions in words: a table with a row for each effect, and reasons below it.

use std::fmt;

use super::{Decider, Decision, Effect, Plan, plan::ROBUST_ITERATIONS};

/// A figure with no more digits than it needs, two at most behind the point.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    match text {
        "-0" => "0".to_owned(),
        _ => text.to_owned(),
    }
}

/// Heads of the columns; the first and the last begin at the left.
const HEAD: [&str; 5] = ["effect", "use", "measured", "threshold", "unit"];

impl Decision {
    /// Cells of its row.
    fn cells(&self) -> [String; 5] {
        let use_it = if self.on { "on" } else { "off" };
        let figure = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), number);
        [
            self.effect.to_string(),
            use_it.to_owned(),
            figure(self.evidence),
            figure(self.evidence.map(|_| self.threshold)),
            self.effect.unit().to_owned(),
        ]
    }

    /// Reasons that the row does not show, if any.
    fn reasons(&self) -> Option<String> {
        let unknown = match (self.evidence, self.effect) {
            (Some(_), _) | (None, Effect::Masks) => None,
            (None, Effect::ChromaDegree) => {
                Some("tried only for an automatic SH degree".to_owned())
            }
            (None, _) => Some("no photos share a point".to_owned()),
        };
        let decider = match (self.decided_by, self.effect) {
            // The degree is off unless it is tried, which is said.
            (Decider::Evidence, _) | (Decider::Preset, Effect::ChromaDegree) => None,
            (Decider::Trial, Effect::TeacherCorrection) => {
                Some("corrected views would differ more".to_owned())
            }
            (Decider::Trial, _) => {
                let gain = self.trial.unwrap_or(0.0);
                let how = if gain < 0.0 { "loses" } else { "gains" };
                let [gain, least] = [gain.abs(), self.effect.trial_gain()].map(number);
                Some(format!("a trial {how} {gain} dB with it; {least} needed"))
            }
            (Decider::User, _) => Some("set by you".to_owned()),
            (Decider::Preset, Effect::Robust) => {
                Some(format!("needs {ROBUST_ITERATIONS} iterations"))
            }
            (Decider::Preset, Effect::Antialias) => Some("longer runs try it".to_owned()),
            (Decider::Preset, _) => Some("set by the preset".to_owned()),
        };
        let reasons: Vec<String> = unknown.into_iter().chain(decider).collect();
        (!reasons.is_empty()).then(|| format!("{}: {}", self.effect, reasons.join("; ")))
    }
}

/// The table of some decisions, and the reasons of those that it does not explain.
pub fn table(decisions: &[Decision]) -> String {
    let mut rows = vec![HEAD.map(str::to_owned)];
    rows.extend(decisions.iter().map(Decision::cells));
    let name = rows.iter().map(|[name, ..]| name.len()).max().unwrap_or(0);
    let line = |[effect, use_it, measured, threshold, unit]: &[String; 5]| {
        format!("{effect:name$}  {use_it:<3}  {measured:>8}  {threshold:>9}  {unit}")
    };
    let lines = rows.iter().map(line);
    let lines = lines.chain(decisions.iter().filter_map(Decision::reasons));
    lines.collect::<Vec<_>>().join("\n")
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&table(&self.decisions))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_figures_thresholds_and_reasons() {
        let exposure = Decision::new(Effect::Exposure, Some(6.7), 2.0);
        let tried = Decision {
            on: false,
            decided_by: Decider::Trial,
            trial: Some(-2.0),
            ..exposure.clone()
        };
        let asked = Decision {
            decided_by: Decider::User,
            ..Decision::new(Effect::Masks, None, 0.0)
        };
        assert_eq!(
            table(&[exposure, tried, asked]),
            "effect    use  measured  threshold  unit\n\
             exposure  on        6.7          2  gray levels between views\n\
             exposure  off       6.7          2  gray levels between views\n\
             masks     off         –          –  % of pixels masked\n\
             exposure: a trial loses 2 dB with it; 0.3 needed\n\
             masks: set by you"
        );
    }

    #[test]
    fn figures_have_the_digits_they_need() {
        let numbers = [0.0, -0.001, 2.0, 0.6, 16.84, 100.0, 0.005].map(number);
        assert_eq!(numbers, ["0", "0", "2", "0.6", "16.84", "100", "0.01"]);
    }

    #[test]
    fn tables_fit_a_terminal() {
        let of_colors = [Effect::TeacherCorrection, Effect::ChromaDegree];
        for effects in [&Effect::ALL[..], &of_colors] {
            for evidence in [Some(12.34), Some(100.0), None] {
                let decided = |&effect: &Effect| Decision::new(effect, evidence, 0.65);
                let table = table(&effects.iter().map(decided).collect::<Vec<_>>());
                let widest = table.lines().map(|line| line.chars().count()).max();
                assert!(widest <= Some(80), "{table}");
            }
        }
    }
}
