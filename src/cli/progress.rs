//! Progress of a command on standard error, and its closing lines.

use std::{
    path::Path,
    time::{Duration, Instant},
};

use super::{
    CliError,
    bar::{Bar, WIDTH},
    next, print, printable,
};
use crate::tell::{Event, Stage};

/// Stages whose messages are figures, of which the last is the best known; those of others name
/// what is at hand.
const FIGURES: [Stage; 6] = [
    Stage::Training,
    Stage::Relight,
    Stage::Degree,
    Stage::Solving,
    Stage::Bake,
    Stage::Sweep,
];

/// Shows the events of a run as progress bars and lines, and knows where its time went.
pub(super) struct Progress {
    begun: Instant,
    /// The stages that are expected, in order.
    stages: Vec<Stage>,
    /// The present one, when it began, and its bar.
    present: Option<(Stage, Instant, Bar)>,
    /// Time spent in each stage.
    spent: Vec<(Stage, Duration)>,
    /// All warnings so far.
    pub warnings: Vec<String>,
}

impl Progress {
    /// For a command that begins now and goes through these stages.
    pub fn through(stages: Vec<Stage>) -> Self {
        Self {
            begun: Instant::now(),
            stages,
            present: None,
            spent: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// Shows one event.
    pub fn show(&mut self, event: &Event) {
        match event {
            Event::Note(lines) => self.print(&printable::printable(lines)),
            Event::Warning(line) => {
                self.print(&printable::line(&format!("warning: {line}")));
                self.warnings.push(line.clone());
            }
            Event::Progress {
                stage,
                done,
                total,
                message,
            } => {
                let bar = match &self.present {
                    Some((present, _, bar)) if present == stage => bar,
                    _ => self.enter(*stage),
                };
                bar.update(*done, *total, message);
            }
        }
    }

    /// Ends the present stage and begins another.
    fn enter(&mut self, stage: Stage) -> &Bar {
        // What comes before all stages belongs to the first.
        let now = match self.spent.is_empty() && self.present.is_none() {
            true => self.begun,
            false => Instant::now(),
        };
        self.leave(now);
        let place = self.stages.iter().position(|&expected| expected == stage);
        let place = place.map(|index| [index + 1, self.stages.len()]);
        let bar = Bar::begin(&stage.to_string(), place);
        &self.present.insert((stage, now, bar)).2
    }

    /// Prints lines above the bar.
    fn print(&self, lines: &str) {
        match &self.present {
            Some((_, _, bar)) => bar.print(lines),
            None => eprintln!("{lines}"),
        }
    }

    /// Ends the present stage, whose bar stays on the screen.
    pub fn finish(&mut self) {
        self.leave(Instant::now());
    }

    /// Ends another's present stage, and takes over what its stages took and its warnings.
    pub fn join(&mut self, other: &mut Self) {
        other.finish();
        for (stage, took) in other.spent.drain(..) {
            self.add(stage, took);
        }
        self.warnings.append(&mut other.warnings);
    }

    fn leave(&mut self, now: Instant) {
        let Some((stage, begun, bar)) = self.present.take() else {
            return;
        };
        bar.end(FIGURES.contains(&stage));
        self.add(stage, now - begun);
    }

    fn add(&mut self, stage: Stage, took: Duration) {
        match self.spent.iter_mut().find(|(known, _)| *known == stage) {
            Some((_, spent)) => *spent += took,
            None => self.spent.push((stage, took)),
        }
    }

    /// The last lines of a command: what took how long, what lies where, and what to type next.
    pub fn close(&mut self, wrote: &[&Path], next: &str) -> Result<(), CliError> {
        self.told(wrote)?;
        print(format_args!("next: {next}"))
    }

    /// The same of a command that made `scene`, and how to look at it.
    pub fn close_with(
        &mut self,
        scene: &Path,
        wrote: &[&Path],
        next: &str,
    ) -> Result<(), CliError> {
        self.told(wrote)?;
        print(format_args!("look: {}", next::see(scene)))?;
        print(format_args!("next: {next}"))
    }

    fn told(&mut self, wrote: &[&Path]) -> Result<(), CliError> {
        self.finish();
        print(took(self.begun.elapsed(), &self.spent))?;
        for path in wrote {
            print(format_args!("wrote {}", path.display()))?;
        }
        Ok(())
    }
}

impl Default for Progress {
    /// For a command without stages.
    fn default() -> Self {
        Self::through(Vec::new())
    }
}

/// Seconds of all and of each stage, in lines no longer than a bar's.
fn took(all: Duration, stages: &[(Stage, Duration)]) -> String {
    let mut text = format!("{:.1} s", all.as_secs_f64());
    let mut columns = text.len();
    let parts = stages
        .iter()
        .map(|(stage, took)| (stage, took.as_secs_f64()));
    // What would be 0.0 is not worth a word.
    for (index, (stage, seconds)) in parts.filter(|(_, s)| *s >= 0.05).enumerate() {
        let part = format!("{stage} {seconds:.1}");
        let mark = if index == 0 { ":" } else { "," };
        // With the mark that follows it.
        let breaks = columns + part.len() + 3 > WIDTH;
        let space = if breaks { "\n  " } else { " " };
        text = text + mark + space + &part;
        columns = part.len() + if breaks { 2 } else { columns + 2 };
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(seconds: f64) -> Duration {
        Duration::from_secs_f64(seconds)
    }

    #[test]
    fn every_stage_has_its_seconds() {
        let of = |stages: &[(Stage, f64)]| {
            let stages: Vec<_> = stages.iter().map(|&(s, t)| (s, seconds(t))).collect();
            took(seconds(61.26), &stages)
        };
        assert_eq!(of(&[]), "61.3 s");
        let some = [
            (Stage::Device, 0.4),
            (Stage::Model, 0.01),
            (Stage::Training, 60.8),
        ];
        assert_eq!(of(&some), "61.3 s: device 0.4, training 60.8");
        let many = [(Stage::Measuring, 12.3); 9];
        let text = of(&many);
        assert!(text.lines().all(|line| line.len() <= WIDTH), "{text}");
        assert_eq!(text.lines().count(), 3);
        assert_eq!(text.replace("\n ", "").matches(", ").count(), 8);
    }

    #[test]
    fn all_time_belongs_to_some_stage() {
        let mut progress = Progress::through(vec![Stage::Device, Stage::Saving]);
        let nap = || std::thread::sleep(Duration::from_millis(20));
        nap();
        for stage in [Stage::Device, Stage::Trial, Stage::Saving, Stage::Trial] {
            progress.show(&Event::begins(stage));
            nap();
        }
        progress.finish();
        let all = progress.begun.elapsed();
        let stages: Vec<Stage> = progress.spent.iter().map(|(stage, _)| *stage).collect();
        assert_eq!(stages, [Stage::Device, Stage::Trial, Stage::Saving]);
        let sum: Duration = progress.spent.iter().map(|(_, took)| *took).sum();
        assert!(
            sum <= all && all - sum < Duration::from_millis(15),
            "{sum:?} {all:?}"
        );
    }
}
