//! Quality against seconds, drawn by plotly.

use plotly::{
    Configuration, Layout, Plot, Scatter,
    color::NamedColor,
    common::{DashType, Font, HoverInfo, Label, Line, LineShape, Marker, MarkerSymbol, Mode},
    configuration::DisplayModeBar,
    layout::{Axis, HoverMode, Margin, RangeMode},
};

use super::{Measure, Phase, Point, PointStage, Tradeoff};
use crate::report::html::escaped;

/// Colours of the knobs, in the order in which they first appear.
const COLORS: [&str; 10] = [
    "#3b6ea8", "#c8643c", "#4f8f4f", "#8a5a9e", "#b0912f", "#3f9aa0", "#b3557c", "#7a6a58",
    "#5f74c4", "#8aa23c",
];

/// Colour of what turns several knobs.
const COMBINED: &str = "#9aa0a8";

/// Colour of bases and of the front.
const INK: &str = "#22252a";

/// Points that are drawn alike: name, colour.
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

/// One plot as HTML, for the element of this name; empty without points.
pub(super) fn plot(id: &str, sweep: &Tradeoff, stage: PointStage, measure: Measure) -> String {
    let place = |point: &Point| Some((point.seconds()?, measure.value(point.outcome.as_ref()?)?));
    if !sweep.of(stage).any(|point| place(point).is_some()) {
        return String::new();
    }
    let mut plot = Plot::new();
    let front = sweep.front(stage, measure);
    if measure.sign().is_some() {
        let (x, y): (Vec<f64>, Vec<f64>) = front.iter().filter_map(|point| place(point)).unzip();
        plot.add_trace(
            Scatter::new(x, y)
                .name("front")
                .mode(Mode::Lines)
                .hover_info(HoverInfo::Skip)
                .line(
                    Line::new()
                        .color(INK)
                        .width(1.2)
                        .dash(DashType::Dot)
                        .shape(LineShape::Hv),
                ),
        );
    }
    let base = sweep.base(stage);
    for group in groups(sweep, stage) {
        let points: Vec<&Point> = (sweep.of(stage))
            .filter(|point| group_of(point) == group.name && place(point).is_some())
            .collect();
        let (x, y): (Vec<f64>, Vec<f64>) = points.iter().filter_map(|point| place(point)).unzip();
        let hover = points.iter().map(|point| in_words(point, base)).collect();
        let names: Vec<String> = points.iter().map(|point| point.name.clone()).collect();
        let on_front = |point: &&Point| front.iter().any(|found| found.name == point.name);
        let sizes = points.iter().map(|point| match point.phase {
            Phase::Base => 15,
            _ if on_front(point) => 12,
            _ => 8,
        });
        let symbol = match points[0].phase {
            Phase::Base => MarkerSymbol::Star,
            Phase::One => MarkerSymbol::Circle,
            Phase::Front => MarkerSymbol::Diamond,
        };
        let marker = Marker::new()
            .color(group.color)
            .symbol(symbol)
            .size_array(sizes.collect())
            .line(Line::new().color("#ffffff").width(1.0));
        plot.add_trace(
            Scatter::new(x, y)
                .name(&group.name)
                .mode(Mode::Markers)
                .marker(marker)
                .custom_data(names)
                .hover_text_array(hover)
                .hover_info(HoverInfo::Text),
        );
    }
    plot.set_layout(layout(measure));
    plot.set_configuration(
        Configuration::new()
            .responsive(true)
            .display_logo(false)
            .display_mode_bar(DisplayModeBar::False),
    );
    plot.to_inline_html(Some(id))
}

/// The library itself, which all plots of a page need once.
pub(super) fn library() -> String {
    const END: &str = "</script>";
    let scripts = Plot::offline_js_sources();
    // The second script sets formulas, of which there are none.
    match scripts.find(END) {
        Some(end) => scripts[..end + END.len()].to_owned(),
        None => scripts,
    }
}

fn layout(measure: Measure) -> Layout {
    let axis = |title: &str| {
        Axis::new()
            .title(title)
            .grid_color("#eeece8")
            .line_color("#d8d5cf")
            .zero_line(false)
            .auto_margin(true)
    };
    Layout::new()
        .x_axis(axis("seconds").range_mode(RangeMode::ToZero))
        .y_axis(axis(&measure.title()))
        .font(
            Font::new()
                .family("system-ui, sans-serif")
                .size(13)
                .color("#454a52"),
        )
        .margin(Margin::new().left(56).right(16).top(14).bottom(44))
        .height(360)
        .show_legend(false)
        .hover_mode(HoverMode::Closest)
        .hover_label(
            Label::new()
                .background_color("#ffffff")
                .font(Font::new().size(13).color(INK)),
        )
        .paper_background_color(NamedColor::White)
        .plot_background_color(NamedColor::White)
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
        format!("<b>{}</b>", escaped(&point.label())),
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
    lines.join("<br>")
}

#[cfg(test)]
mod tests {
    use super::super::tests::{failed, luma, sweep};
    use super::*;

    #[test]
    fn a_plot_holds_every_point_and_the_front() {
        let mut odd = luma("max-side-<200>", 5.0, 22.0);
        odd.name = "</script>".to_owned();
        let sweep = sweep(vec![luma("base", 10.0, 24.0), failed("sh-3", "no"), odd]);
        let html = plot("here", &sweep, PointStage::Luma, Measure::Psnr);
        assert!(
            html.contains("id=\"here\"") && html.contains("\"shape\":\"hv\""),
            "{html}"
        );
        assert!(html.contains("[5.0,10.0]"), "{html}");
        assert_eq!(html.matches("</script>").count(), 1, "{html}");
        assert!(!html.contains("<200>") && html.contains("&amp;lt;") | html.contains("lt;200"));
        assert!(plot("here", &sweep, PointStage::Color, Measure::DeltaE).is_empty());
        let names: Vec<String> = groups(&sweep, PointStage::Luma)
            .into_iter()
            .map(|g| g.name)
            .collect();
        assert_eq!(names, ["base", "max"]);
    }

    #[test]
    fn the_library_is_there_and_nothing_is_fetched() {
        let library = library();
        assert!(library.starts_with("<script") && library.ends_with("</script>"));
        assert!(library.len() > 1 << 20 && library.len() < 6_000_000);
        assert!(!library.contains("<script src"));
    }
}
