//! Quality against seconds as SVG, drawn into the page: nothing is fetched, and a
//! browser shows a point's `<title>` under the pointer.

use std::fmt::Write;

use super::{Measure, Phase, Point, PointStage, Tradeoff};
use crate::report::html::escaped;

/// Colors of the knobs, in the order in which they first appear.
const COLORS: [&str; 10] = [
    "#3b6ea8", "#c8643c", "#4f8f4f", "#8a5a9e", "#b0912f", "#3f9aa0", "#b3557c", "#7a6a58",
    "#5f74c4", "#8aa23c",
];

/// Color of what turns several knobs.
const COMBINED: &str = "#9aa0a8";

/// Color of bases and of the front.
const INK: &str = "currentColor";

/// Points that are drawn alike: name, color.
pub(super) struct Group {
    /// The knob, `base` or `combinations`.
    pub name: String,
    /// As CSS has it.
    pub color: &'static str,
}

/// The groups of a stage's points.
pub(super) fn groups(sweep: &Tradeoff, stage: PointStage) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut knobs = 0;
    for point in sweep.of(stage).filter(|point| point.outcome.is_some()) {
        let name = group_of(point);
        if groups.iter().any(|group| group.name == name) {
            continue;
        }
        let color = match point.phase {
            Phase::Base => INK,
            Phase::Front => COMBINED,
            Phase::One => {
                knobs += 1;
                COLORS[(knobs - 1) % COLORS.len()]
            }
        };
        groups.push(Group {
            name: name.to_owned(),
            color,
        });
    }
    groups
}

fn group_of(point: &Point) -> &str {
    match (point.phase, &point.settings[..]) {
        (Phase::Base, _) => "base",
        (Phase::One, [only]) => &only.knob,
        _ => "combinations",
    }
}

/// One plot as SVG; empty without points.
pub(super) fn plot(sweep: &Tradeoff, stage: PointStage, measure: Measure) -> String {
    let place = |point: &Point| Some([point.seconds()?, measure.value(point.outcome.as_ref()?)?]);
    let placed: Vec<(&Point, [f64; 2])> = (sweep.of(stage))
        .filter_map(|point| Some((point, place(point)?)))
        .filter(|(_, at)| at.iter().all(|value| value.is_finite()))
        .collect();
    if placed.is_empty() {
        return String::new();
    }
    let values = |axis: usize| placed.iter().map(move |(_, at)| at[axis]);
    let seconds = Scale::around(values(0).chain([0.0]), [LEFT, RIGHT], 8);
    let quality = Scale::around(values(1), [BOTTOM, TOP], 6);
    let mut svg = axes(&seconds, &quality, &measure.title());
    let front = match measure.sign() {
        Some(_) => sweep.front(stage, measure),
        None => Vec::new(),
    };
    push_front(
        &mut svg,
        front.iter().filter_map(|point| place(point)),
        &seconds,
        &quality,
    );
    let groups = groups(sweep, stage);
    let base = sweep.base(stage);
    for (point, at) in &placed {
        let group = groups.iter().find(|group| group.name == group_of(point));
        let size = match point.phase {
            Phase::Base => 8.0,
            _ if front.iter().any(|found| found.name == point.name) => 6.0,
            _ => 4.0,
        };
        // Writing to a string cannot fail.
        let _ = writeln!(
            svg,
            "<g class=\"point\" data-name=\"{}\" fill=\"{}\" transform=\"translate({:.1} {:.1}) scale({size})\"><title>{}</title>{}</g>",
            escaped(&point.name),
            group.map_or(INK, |group| group.color),
            seconds.at(at[0]),
            quality.at(at[1]),
            escaped(&in_words(point, base)),
            mark(point.phase),
        );
    }
    svg.push_str("</svg>");
    svg
}

/// Size of a plot in SVG units, and where its axes end.
const SIZE: [f64; 2] = [560.0, 360.0];
const LEFT: f64 = 62.0;
const RIGHT: f64 = SIZE[0] - 14.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = SIZE[1] - 46.0;

/// A linear axis with round steps.
struct Scale {
    /// Values at the ends of the axis.
    values: [f64; 2],
    /// SVG coordinates of its ends.
    ends: [f64; 2],
    /// Distance of its ticks.
    step: f64,
}

impl Scale {
    /// An axis that holds all these values, from a tick to a tick, with about so many ticks.
    fn around(values: impl Iterator<Item = f64>, ends: [f64; 2], ticks: usize) -> Self {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        // One value alone stands in the middle of something.
        let span = match high > low {
            true => high - low,
            false => high.abs().max(1.0) * 0.1,
        };
        let step = round_step(span / ticks as f64);
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

    /// Where a value lies.
    fn at(&self, value: f64) -> f64 {
        let [low, high] = self.values;
        let [first, last] = self.ends;
        first + (last - first) * (value - low) / (high - low)
    }

    /// Its ticks: where they lie, and what they say.
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

/// The smallest of 1, 2, 5 times a power of ten that is no smaller.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    let rounds = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power);
    // A step just above a round one by rounding alone is that one.
    let fits = |round: &f64| *round >= step * (1.0 - 1e-9);
    rounds.into_iter().find(fits).unwrap_or(step)
}

/// The SVG's beginning: grid, ticks and titles.
fn axes(seconds: &Scale, quality: &Scale, title: &str) -> String {
    let [width, height] = SIZE;
    let title = escaped(title);
    let mut svg = format!(
        "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{title} against seconds\" font-family=\"system-ui, sans-serif\" font-size=\"12\">\n<g stroke=\"var(--hair)\">"
    );
    for (x, _) in seconds.ticks() {
        let _ = write!(svg, "<path d=\"M{x:.1} {TOP}V{BOTTOM}\"/>");
    }
    for (y, _) in quality.ticks() {
        let _ = write!(svg, "<path d=\"M{LEFT} {y:.1}H{RIGHT}\"/>");
    }
    svg.push_str("</g>\n<g text-anchor=\"middle\">");
    for (x, words) in seconds.ticks() {
        let _ = write!(
            svg,
            "<text x=\"{x:.1}\" y=\"{}\">{words}</text>",
            BOTTOM + 16.0
        );
    }
    let [middle, bottom] = [(LEFT + RIGHT) / 2.0, SIZE[1] - 8.0];
    let _ = write!(svg, "<text x=\"{middle}\" y=\"{bottom}\">seconds</text>");
    let middle = (TOP + BOTTOM) / 2.0;
    let _ = write!(
        svg,
        "<text transform=\"translate(14 {middle}) rotate(-90)\">{title}</text></g>\n<g text-anchor=\"end\">"
    );
    for (y, words) in quality.ticks() {
        let _ = write!(
            svg,
            "<text x=\"{}\" y=\"{:.1}\">{words}</text>",
            LEFT - 6.0,
            y + 4.0
        );
    }
    svg.push_str("</g>\n");
    svg
}

/// The front as steps: between two of its points the faster one is the best to be had.
fn push_front(
    svg: &mut String,
    places: impl Iterator<Item = [f64; 2]>,
    seconds: &Scale,
    quality: &Scale,
) {
    let mut path = String::new();
    for [x, y] in places {
        let (x, y) = (seconds.at(x), quality.at(y));
        let _ = match path.is_empty() {
            true => write!(path, "M{x:.1} {y:.1}"),
            false => write!(path, "H{x:.1}V{y:.1}"),
        };
    }
    if !path.is_empty() {
        let _ = writeln!(
            svg,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{INK}\" stroke-width=\"1.2\" stroke-dasharray=\"2 3\"/>"
        );
    }
}

/// The shape of a point about the origin, of size 1.
fn mark(phase: Phase) -> &'static str {
    match phase {
        Phase::Base => {
            "<path d=\"M0-1 .26-.36.95-.31.42.14.59.81 0 .44-.59.81-.42.14-.95-.31-.26-.36Z\"/>"
        }
        Phase::One => "<circle r=\"1\"/>",
        Phase::Front => "<path d=\"M0-1.1 1.1 0 0 1.1-1.1 0Z\"/>",
    }
}

/// What is shown of a point under the pointer.
fn in_words(point: &Point, base: Option<&Point>) -> String {
    let Some(outcome) = &point.outcome else {
        return String::new();
    };
    let against = base.filter(|base| base.name != point.name);
    let against = against.and_then(|base| base.outcome.as_ref());
    let factor = against.map_or(String::new(), |base| {
        format!(
            " (× {:.2})",
            outcome.seconds.total / base.seconds.total.max(1e-9)
        )
    });
    let mut lines = vec![
        point.label(),
        format!("{:.1} s{factor}", outcome.seconds.total),
    ];
    for &measure in Measure::of(point.stage) {
        let Some(value) = measure.value(outcome) else {
            continue;
        };
        let digits = measure.digits();
        let change = (against.and_then(|base| measure.value(base))).map_or(String::new(), |base| {
            format!(" ({:+.digits$})", value - base)
        });
        lines.push(measure.in_words(value) + &change);
    }
    lines.push(format!("{} Gaussians", outcome.splats));
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::super::tests::{failed, luma, sweep};
    use super::*;

    #[test]
    fn a_plot_holds_every_point_and_the_front() {
        let mut odd = luma("max-side-<200>", 5.0, 22.0);
        odd.name = "\"><script>".to_owned();
        let sweep = sweep(vec![luma("base", 10.0, 24.0), failed("sh-3", "no"), odd]);
        let svg = plot(&sweep, PointStage::Luma, Measure::Psnr);
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>"), "{svg}");
        assert_eq!(svg.matches("class=\"point\"").count(), 2, "{svg}");
        assert!(svg.contains("data-name=\"base\""), "{svg}");
        assert!(svg.contains("<title>base\n10.0 s\nPSNR 24.00 dB"), "{svg}");
        assert!(
            svg.contains("5.0 s (× 0.50)\nPSNR 22.00 dB (-2.00)"),
            "{svg}"
        );
        // From the faster point along its quality to the slower one's time, then up.
        let front = format!(
            "M{x0:.1} {y0:.1}H{x1:.1}V{y1:.1}\"",
            x0 = LEFT + (RIGHT - LEFT) * 5.0 / 12.0,
            x1 = LEFT + (RIGHT - LEFT) * 10.0 / 12.0,
            y0 = BOTTOM - (BOTTOM - TOP) * 0.5 / 3.0,
            y1 = BOTTOM - (BOTTOM - TOP) * 2.5 / 3.0,
        );
        assert!(svg.contains(&front), "{front} in {svg}");
        assert!(!svg.contains("<200>") && !svg.contains("<script>"), "{svg}");
        assert!(plot(&sweep, PointStage::Color, Measure::DeltaE).is_empty());
        let names: Vec<String> = groups(&sweep, PointStage::Luma)
            .into_iter()
            .map(|g| g.name)
            .collect();
        assert_eq!(names, ["base", "max"]);
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
            let scale = Scale::around(values.iter().copied(), [0.0, 100.0], 6);
            let ticks: Vec<(f64, String)> = scale.ticks().collect();
            assert!((2..=10).contains(&ticks.len()), "{values:?}: {ticks:?}");
            assert!(
                ticks
                    .iter()
                    .all(|(x, _)| (-1e-6..=100.0 + 1e-6).contains(x))
            );
            assert!(values.iter().all(|&v| (0.0..=100.0).contains(&scale.at(v))));
            let mut words: Vec<&String> = ticks.iter().map(|(_, words)| words).collect();
            words.dedup();
            assert_eq!(words.len(), ticks.len(), "{ticks:?}");
        }
        assert_eq!(
            [0.3, 1.0, 1.2, 4.0, 70.0].map(round_step),
            [0.5, 1.0, 2.0, 5.0, 100.0]
        );
    }
}
