//! Decisions in words: a line an effect, with its figure, its threshold and the reason.

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

impl Effect {
    /// The evidence and its threshold, in words.
    fn found(self, figure: f64, threshold: f64) -> String {
        let (x, least) = (number(figure), number(threshold));
        let (found, count) = match self {
            Self::Lens => (format!("the lens moves pixels by {x}"), "be visible"),
            Self::Masks => return format!("{x} % of the pixels are masked"),
            Self::Exposure => (format!("photos differ by {x} gray levels"), "be visible"),
            Self::Robust => (format!("{x} % of places differ in one photo"), "matter"),
            Self::Antialias => (format!("near views are {x} times finer"), "matter"),
            Self::Background => (format!("{x} % of the photos lie far behind"), "matter"),
            Self::LumaDegree => (format!("direction changes {x} gray levels"), "matter"),
            Self::TeacherCorrection => (format!("views differ by {x} CIELAB units"), "be visible"),
            Self::ChromaDegree => (format!("views held back gain {x} %"), "be worth it"),
        };
        format!("{found}; {least} would {count}")
    }

    /// Text for missing evidence.
    fn unknown(self) -> &'static str {
        match self {
            Self::Masks => "no photo has a mask",
            Self::ChromaDegree => "not tried; an automatic SH degree is",
            _ => "no point that several photos show tells",
        }
    }
}

impl fmt::Display for Decision {
    /// A line of the table that a user sees.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found = match self.evidence {
            Some(figure) => self.effect.found(figure, self.threshold),
            None => self.effect.unknown().to_owned(),
        };
        let on = if self.on { "on" } else { "off" };
        write!(f, "{:<18} {on:<3} {found}", self.effect.to_string())?;
        match (self.decided_by, self.effect) {
            (Decider::Evidence, _) => Ok(()),
            (Decider::Trial, Effect::TeacherCorrection) => {
                f.write_str(", but corrected they would differ more")
            }
            (Decider::Trial, _) => {
                f.write_str(&tried(self.trial.unwrap_or(0.0), self.effect.trial_gain()))
            }
            (Decider::User, _) => f.write_str("; set by you"),
            (Decider::Preset, Effect::Robust) => {
                write!(f, "; a run of {ROBUST_ITERATIONS} iterations could tell")
            }
            (Decider::Preset, Effect::Antialias) => {
                f.write_str("; a longer run could try what viewers make of it")
            }
            // Said already, or what is always done.
            (Decider::Preset, Effect::ChromaDegree) => Ok(()),
            (Decider::Preset, _) => f.write_str("; the preset decides"),
        }
    }
}

/// Result of a trial in words; gains in dB.
fn tried(gain: f64, least: f64) -> String {
    let (how, but) = match gain < least {
        true if gain < 0.0 => ("loses", "but"),
        true => ("gains", "but"),
        false => ("gains", "and"),
    };
    let (gain, least) = (number(gain.abs()), number(least));
    format!(", {but} a trial {how} {gain} dB with it; {least} would count")
}

/// The table of some decisions.
pub fn table(decisions: &[Decision]) -> String {
    let rows: Vec<String> = decisions.iter().map(Decision::to_string).collect();
    rows.join("\n")
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
    fn a_line_has_figure_threshold_and_reason() {
        let exposure = Decision::new(Effect::Exposure, Some(6.7), 2.0);
        assert_eq!(
            exposure.to_string(),
            "exposure           on  photos differ by 6.7 gray levels; 2 would be visible"
        );
        let asked = Decision {
            on: false,
            decided_by: Decider::User,
            ..exposure
        };
        assert_eq!(
            asked.to_string(),
            "exposure           off photos differ by 6.7 gray levels; 2 would be visible; set by you"
        );
        assert_eq!(
            Decision::new(Effect::Masks, None, 0.0).to_string(),
            "masks              off no photo has a mask"
        );
    }

    #[test]
    fn figures_have_the_digits_they_need() {
        let numbers = [0.0, -0.001, 2.0, 0.6, 16.84, 100.0, 0.005].map(number);
        assert_eq!(numbers, ["0", "0", "2", "0.6", "16.84", "100", "0.01"]);
    }

    #[test]
    fn lines_that_the_evidence_decides_fit_a_terminal() {
        let effects = [Effect::TeacherCorrection, Effect::ChromaDegree];
        for effect in Effect::ALL.into_iter().chain(effects) {
            for evidence in [Some(12.34), Some(100.0), None] {
                let line = Decision::new(effect, evidence, 0.65).to_string();
                assert!(line.len() <= 80, "{line}");
            }
        }
    }
}
