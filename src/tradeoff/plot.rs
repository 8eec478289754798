//! Quality against seconds as SVG, drawn into the page: nothing is fetched.

use plotters::{
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

use super::sweep::{Measure, PointStage, SweepPoint, Tradeoff};

/// A plot as SVG; empty without points.
pub(super) fn plot(sweep: &Tradeoff, stage: PointStage, measure: &Measure) -> String {
    let mut svg = String::new();
    // Whoever draws into a string does not fail.
    let _ = draw(&mut svg, sweep, stage, measure);
    svg.replace("#000000", "currentColor")
}

fn draw(
    svg: &mut String,
    sweep: &Tradeoff,
    stage: PointStage,
    measure: &Measure,
) -> Result<(), Box<dyn std::error::Error>> {
    let place = |point: &SweepPoint| {
        let outcome = point.outcome.as_ref()?;
        let place = (outcome.seconds, (measure.value)(outcome)?);
        (place.0 > 0.0 && place.0.is_finite() && place.1.is_finite()).then_some(place)
    };
    let points = sweep
        .of(stage)
        .filter_map(|point| Some((point, place(point)?)));
    let points: Vec<(&SweepPoint, (f64, f64))> = points.collect();
    let ends = |values: &dyn Fn(&(f64, f64)) -> f64| {
        let values = points.iter().map(|(_, place)| values(place));
        values.fold([f64::MAX, f64::MIN], |[low, high], v| {
            [low.min(v), high.max(v)]
        })
    };
    let ([first, last], [low, high]) = (ends(&|place| place.0), ends(&|place| place.1));
    if points.is_empty() {
        return Ok(());
    }
    // A value alone stands in the middle.
    let room = (0.05 * (high - low)).max(0.01 * high.abs());
    let area = SVGBackend::with_string(svg, (560, 360)).into_drawing_area();
    let mut chart = ChartBuilder::on(&area)
        .margin(10)
        .x_label_area_size(38)
        .y_label_area_size(56)
        .build_cartesian_2d(
            (first / 1.1..last * 1.1)
                .log_scale()
                .with_key_points(ticks(first / 1.1, last * 1.1)),
            low - room..high + room,
        )?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_label_formatter(&|seconds| format!("{seconds}"))
        .x_desc("seconds")
        .y_desc(measure.title)
        .draw()?;
    // Between two points of the front the faster one is the best to be had.
    let mut steps: Vec<(f64, f64)> = Vec::new();
    for at in sweep.front(stage, measure).into_iter().filter_map(place) {
        steps.extend(steps.last().map(|before| (at.0, before.1)));
        steps.push(at);
    }
    chart.draw_series(LineSeries::new(steps, BLACK.mix(0.5)))?;
    let style = ("sans-serif", 11).into_font().color(&BLACK.mix(0.7));
    let middle = (first * last).sqrt();
    chart.draw_series(points.iter().map(|(point, at)| {
        let (size, label) = match point.after {
            Some(_) => (3, String::new()),
            None => (5, point.label()),
        };
        // Above the front's lines, and inside the picture.
        let (side, anchor) = match at.0 > middle {
            true => (-6, HPos::Right),
            false => (6, HPos::Left),
        };
        let style = style.pos(Pos::new(anchor, VPos::Bottom));
        let label = Text::new(label, (side, -3), style);
        EmptyElement::at(*at) + Circle::new((0, 0), size, BLACK.filled()) + label
    }))?;
    area.present()?;
    Ok(())
}

/// Round seconds of a logarithmic axis: fewer in a decade where there are several.
fn ticks(from: f64, to: f64) -> Vec<f64> {
    let digits: &[&str] = match to / from {
        ..10.0 => &["1", "1.5", "2", "3", "4", "5", "7"],
        ..1e3 => &["1", "2", "5"],
        _ => &["1"],
    };
    let decades = from.log10().floor() as i32..=to.log10().floor() as i32;
    // Parsed, they are as round as they are written.
    decades
        .flat_map(|decade| digits.iter().map(move |digit| format!("{digit}e{decade}")))
        .filter_map(|tick| tick.parse().ok())
        .filter(|tick| (from..=to).contains(tick))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{failed, luma, sweep};
    use super::*;

    #[test]
    fn ticks_are_round_and_neither_few_nor_many() {
        assert_eq!(ticks(3.2, 8.5), [4.0, 5.0, 7.0]);
        assert_eq!(ticks(0.15, 0.35), [0.15, 0.2, 0.3]);
        assert_eq!(ticks(1.6, 24.0), [2.0, 5.0, 10.0, 20.0]);
        assert_eq!(ticks(0.5, 2e3), [1.0, 10.0, 100.0, 1000.0]);
    }

    #[test]
    fn a_plot_holds_every_point_and_the_front() {
        let odd = luma("max-side-<200>", 5.0, 22.0);
        let points = vec![luma("base", 10.0, 24.0), failed("sh-3", "no"), odd];
        let sweep = sweep(points);
        let measure = sweep.measures(PointStage::Luma).next().expect("PSNR");
        let svg = plot(&sweep, PointStage::Luma, measure);
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
        assert_eq!(svg.matches("<circle").count(), 2, "{svg}");
        // From the faster point to the slower one's time, then up.
        let half = "opacity=\"0.5\"";
        let line = svg.split("<polyline").find(|part| part.contains(half));
        let corners = line.and_then(|line| line.split("points=\"").nth(1));
        let corners = corners.and_then(|corners| corners.split('"').next());
        assert_eq!(
            corners.map(|c| c.split_whitespace().count()),
            Some(3),
            "{svg}"
        );
        assert!(!svg.contains("<200>"), "{svg}");
        assert!(plot(&sweep, PointStage::Color, measure).is_empty());
    }
}
