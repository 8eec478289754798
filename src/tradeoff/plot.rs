//! Quality against seconds as SVG, drawn into the page: nothing is fetched, and a
//! browser shows a point's `<title>` under the pointer.

use std::fmt::Write;

use super::{
    knobs::KNOBS,
    sweep::{Measure, Outcome, PointStage, SweepPoint, Tradeoff},
};
use crate::report::html::escaped;

/// Colors of the knobs, in their order.
const COLORS: [&str; KNOBS.len()] = [
    "#3b6ea8", "#c8643c", "#4f8f4f", "#8a5a9e", "#b0912f", "#3f9aa0", "#b3557c",
];

/// Color of what is tried on smaller photos.
const SMALL: &str = "#9aa0a8";

/// Edges of the axes in a plot of 560 by 360.
const LEFT: f64 = 62.0;
const RIGHT: f64 = 546.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 314.0;

/// A point's group and its color.
pub(super) fn group(point: &SweepPoint) -> (&str, &'static str) {
    match &point.settings[..] {
        [] => ("base", "currentColor"),
        [only] => {
            let place = KNOBS.iter().position(|knob| knob.name == only.knob);
            (&only.knob, place.map_or(SMALL, |place| COLORS[place]))
        }
        _ => ("smaller photos", SMALL),
    }
}

/// A plot as SVG; empty without points.
pub(super) fn plot(sweep: &Tradeoff, stage: PointStage, measure: &Measure) -> String {
    let place = |outcome: &Outcome| {
        let place = [outcome.seconds, (measure.value)(outcome)?];
        let finite = place.iter().all(|figure| figure.is_finite());
        finite.then_some(place)
    };
    let placed: Vec<(&SweepPoint, &Outcome, [f64; 2])> = (sweep.of(stage))
        .filter_map(|point| {
            let outcome = point.outcome.as_ref()?;
            Some((point, outcome, place(outcome)?))
        })
        .collect();
    if placed.is_empty() {
        return String::new();
    }
    let values = |axis: usize| placed.iter().map(move |(_, _, at)| at[axis]);
    let seconds = Axis::around(values(0).chain([0.0]), [LEFT, RIGHT]);
    let quality = Axis::around(values(1), [BOTTOM, TOP]);
    let mut svg = axes(&seconds, &quality, measure.title);
    // Between two points of the front the faster one is the best to be had.
    let front = sweep.front(stage, measure);
    let mut path = String::new();
    for [x, y] in (front.iter()).filter_map(|point| place(point.outcome.as_ref()?)) {
        let to = if path.is_empty() {
            ['M', ' ']
        } else {
            ['H', 'V']
        };
        let _ = write!(
            path,
            "{}{:.1}{}{:.1}",
            to[0],
            seconds.at(x),
            to[1],
            quality.at(y)
        );
    }
    // Writing to a string cannot fail.
    let _ = writeln!(
        svg,
        "<path d=\"{path}\" fill=\"none\" stroke=\"currentColor\" stroke-dasharray=\"2 3\"/>"
    );
    for (point, outcome, [x, y]) in &placed {
        let size = match point.after {
            Some(_) => 3,
            None if point.is_base() => 8,
            _ if front.iter().any(|found| found.name == point.name) => 6,
            _ => 4,
        };
        let _ = writeln!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{size}\" fill=\"{}\"><title>{}\n{x:.1} s{}\n{} Gaussians</title></circle>",
            seconds.at(*x),
            quality.at(*y),
            group(point).1,
            escaped(&point.label()),
            measure.in_words(outcome),
            outcome.splats,
        );
    }
    svg + "</svg>"
}

/// A linear axis with round steps.
struct Axis {
    /// Values at the ends of the axis.
    values: [f64; 2],
    /// SVG coordinates of its ends.
    ends: [f64; 2],
    /// Distance of its ticks.
    step: f64,
}

impl Axis {
    /// An axis that holds all these values, from a tick to a tick.
    fn around(values: impl Iterator<Item = f64>, ends: [f64; 2]) -> Self {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        // One value alone stands in the middle of something.
        let span = match high > low {
            true => high - low,
            false => high.abs().max(1.0) * 0.1,
        };
        // About six ticks, at the next multiple of 1, 2 or 5.
        let power = 10_f64.powf((span / 6.0).log10().floor());
        let rounds = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
        let round = rounds.into_iter().find(|round| *round >= span / 6.0);
        let step = round.unwrap_or(span);
        // A point at the very end would be half outside; nothing is below no seconds.
        let room = 0.04 * span;
        let low = match low == 0.0 {
            true => 0.0,
            false => ((low - room) / step).floor() * step,
        };
        let high = ((high + room) / step).ceil() * step;
        Self {
            values: [low, high],
            ends,
            step,
        }
    }

    /// Position of a value.
    fn at(&self, value: f64) -> f64 {
        let [low, high] = self.values;
        let [first, last] = self.ends;
        first + (last - first) * (value - low) / (high - low)
    }

    /// Its ticks: positions and labels.
    fn ticks(&self) -> impl Iterator<Item = (f64, String)> {
        let digits = (-self.step.log10().floor()).clamp(0.0, 12.0) as usize;
        let [low, high] = self.values;
        let steps = ((high - low) / self.step).round() as usize;
        (0..=steps).map(move |index| {
            let value = low + index as f64 * self.step;
            (self.at(value), format!("{value:.digits$}"))
        })
    }
}

/// The SVG's beginning: grid, ticks and titles.
fn axes(seconds: &Axis, quality: &Axis, title: &str) -> String {
    let mut svg = format!(
        "<svg viewBox=\"0 0 560 360\" role=\"img\" aria-label=\"{title} against seconds\" font-size=\"12\" text-anchor=\"middle\">\n"
    );
    for (x, words) in seconds.ticks() {
        let _ = writeln!(
            svg,
            "<path d=\"M{x:.1} {TOP}V{BOTTOM}\" stroke=\"var(--hair)\"/><text x=\"{x:.1}\" y=\"330\">{words}</text>"
        );
    }
    for (y, words) in quality.ticks() {
        let _ = writeln!(
            svg,
            "<path d=\"M{LEFT} {y:.1}H{RIGHT}\" stroke=\"var(--hair)\"/><text x=\"56\" y=\"{y:.1}\" dy=\"4\" text-anchor=\"end\">{words}</text>"
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"304\" y=\"352\">seconds</text><text transform=\"translate(14 164) rotate(-90)\">{title}</text>"
    );
    svg
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{failed, luma, sweep};
    use super::*;

    #[test]
    fn a_plot_holds_every_point_and_the_front() {
        let odd = luma("max-side-<200>", 5.0, 22.0);
        let sweep = sweep(vec![luma("base", 10.0, 24.0), failed("sh-3", "no"), odd]);
        let measure = sweep.measures(PointStage::Luma).next().expect("PSNR");
        let svg = plot(&sweep, PointStage::Luma, measure);
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>"), "{svg}");
        assert_eq!(svg.matches("<circle").count(), 2, "{svg}");
        let words = "<title>base\n10.0 s, PSNR 24.00 dB\n1000 Gaussians</title>";
        assert!(svg.contains(words), "{svg}");
        // From the faster point along its quality to the slower one's time, then up.
        let front = format!(
            "M{x0:.1} {y0:.1}H{x1:.1}V{y1:.1}\"",
            x0 = LEFT + (RIGHT - LEFT) * 5.0 / 12.0,
            x1 = LEFT + (RIGHT - LEFT) * 10.0 / 12.0,
            y0 = BOTTOM - (BOTTOM - TOP) * 0.5 / 3.0,
            y1 = BOTTOM - (BOTTOM - TOP) * 2.5 / 3.0,
        );
        assert!(svg.contains(&front), "{front} in {svg}");
        assert!(!svg.contains("<200>"), "{svg}");
        assert!(plot(&sweep, PointStage::Color, measure).is_empty());
    }

    #[test]
    fn axes_end_at_round_values_and_hold_every_point() {
        for values in [
            vec![0.0, 0.0],
            vec![24.0],
            vec![-3.0, 5.0],
            vec![0.81234, 0.81301],
            vec![0.0, 12_345.6],
        ] {
            let axis = Axis::around(values.iter().copied(), [0.0, 100.0]);
            let ticks: Vec<(f64, String)> = axis.ticks().collect();
            assert!((2..=10).contains(&ticks.len()), "{values:?}: {ticks:?}");
            assert!(values.iter().all(|&v| (0.0..=100.0).contains(&axis.at(v))));
            let mut words: Vec<&String> = ticks.iter().map(|(_, words)| words).collect();
            words.dedup();
            assert_eq!(words.len(), ticks.len(), "{ticks:?}");
        }
    }
}
