//! `tradeoff.html`: one file that needs nothing else.

use std::{collections::BTreeMap, fmt::Write};

use base64::prelude::{BASE64_STANDARD, Engine as _};

use super::{
    Measure, Point, PointStage, Tradeoff,
    plots::{groups, plot},
    shell_line,
    tables::{cost_table, figure, front_table, measures, memory},
};
use crate::report::html::{TAIL, escaped, head, push_table};

/// Small JPEGs of one held-out view.
#[derive(Clone, Debug, Default)]
pub struct Pictures {
    /// The view's name.
    pub view: String,
    /// The photo.
    pub photo: Option<Vec<u8>>,
    /// What the points make of it, by their names.
    pub points: BTreeMap<String, Vec<u8>>,
}

/// Shows the picture of the point under the pointer beside the photo.
const SCRIPT: &str = r#"<script>
for (const point of document.querySelectorAll(".point")) {
  point.addEventListener("pointerenter", () => {
    const from = document.getElementById("point-" + point.dataset.name);
    const figure = point.closest("section").querySelector(".shown");
    const picture = from && from.querySelector("img");
    if (!picture || !figure) return;
    figure.querySelector("img").src = picture.src;
    figure.querySelector("figcaption").textContent = from.dataset.label;
  });
}
</script>
"#;

/// What this page needs besides the style of all.
const STYLE: &str = "<style>
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(380px, 1fr)); gap: 1rem; }
.plots > div { background: var(--card); border-radius: 6px; box-shadow: 0 1px 3px var(--shadow); min-width: 0; padding: .3rem; }
.plots svg { display: block; width: 100%; color: var(--ink); fill: var(--quiet); }
.point { stroke: var(--card); stroke-width: 1; }
.point > * { vector-effect: non-scaling-stroke; }
.point:hover { stroke: var(--ink); }
.legend { display: flex; flex-wrap: wrap; gap: .2rem 1.1rem; margin: .5rem 0; font-size: .85rem; color: var(--quiet); }
.legend i { display: inline-block; width: .7rem; height: .7rem; border-radius: 50%; margin-right: .35rem; color: var(--ink); }
.film { display: flex; gap: .8rem; overflow-x: auto; margin: 1rem 0; padding-bottom: .3rem; }
.film figure { flex: 0 0 230px; }
.film .photo { border-bottom: 3px solid #c8643c; }
.film .shown { border-bottom: 3px solid #3b6ea8; }
.small img { display: block; width: 96px; border-radius: 3px; }
td.small { padding: .25rem .4rem; }
th.words, td.words { text-align: left; white-space: normal; min-width: 12rem; }
td.failed { color: var(--bad); }
details code { display: block; max-width: 46rem; margin: .3rem 0; padding: .35rem .5rem; background: var(--hair); border-radius: 4px; font-size: .78rem; white-space: pre-wrap; overflow-wrap: anywhere; user-select: all; text-align: left; }
summary { cursor: pointer; color: var(--link); }
</style>
";

/// The page's HTML.
pub fn page(sweep: &Tradeoff, pictures: &Pictures) -> String {
    let mut html = head("gs-chroma trade-off");
    html.push_str(STYLE);
    let subject = &sweep.subject;
    let scene = subject.scene.rsplit(['/', '\\']).next().unwrap_or_default();
    let teacher = subject.teacher.as_ref();
    // Writing to a string cannot fail.
    let _ = writeln!(
        html,
        "<h1>{}: what quality costs in time</h1>\n<p class=\"note\">gs-chroma {}; preset {}{}{}; {} points in {:.1} of {:.1} minutes.</p>",
        escaped(scene),
        escaped(&sweep.program),
        escaped(&subject.preset),
        teacher.map_or(String::new(), |path| format!("; teacher {}", escaped(path))),
        sweep
            .device
            .as_ref()
            .map_or(String::new(), |name| format!("; {}", escaped(name))),
        sweep.points.len(),
        sweep.spent() / 60.0,
        sweep.budget / 60.0,
    );
    for stage in [PointStage::Luma, PointStage::Color] {
        push_stage(&mut html, sweep, stage, pictures);
    }
    for stage in [PointStage::Luma, PointStage::Color] {
        push_points(&mut html, sweep, stage, pictures);
    }
    html.push_str(SCRIPT);
    html.push_str(TAIL);
    html
}

/// A stage's plots, its front in pictures and figures, and what its knobs cost.
fn push_stage(html: &mut String, sweep: &Tradeoff, stage: PointStage, pictures: &Pictures) {
    let Some(decisive) = sweep.decisive(stage) else {
        return;
    };
    let (title, note) = match stage {
        PointStage::Luma => (
            "Luma",
            "Seconds are those of <code>fit</code>: reading, training, measuring.",
        ),
        PointStage::Color => (
            "Color",
            "Seconds contain the base's luma, on which all of these points are colored, and asking the teacher, measured where it was asked. A colorfulness is neither good nor bad by itself.",
        ),
    };
    let _ = writeln!(
        html,
        "<section>\n<h2>{title}</h2>\n<p class=\"note\">Measured on held-out views. The dotted line is the best that is to be had in a time: the Pareto front. {note}</p>"
    );
    html.push_str("<div class=\"legend\">");
    for group in groups(sweep, stage) {
        let _ = write!(
            html,
            "<span><i style=\"background:{}\"></i>{}</span>",
            group.color,
            escaped(&group.name)
        );
    }
    html.push_str("</div>\n<div class=\"plots\">\n");
    for &measure in Measure::of(stage) {
        let plot = plot(sweep, stage, measure);
        if !plot.is_empty() {
            let _ = writeln!(html, "<div>{plot}</div>");
        }
    }
    html.push_str("</div>\n");
    push_film(html, &sweep.front(stage, decisive), pictures);
    let tables = [front_table(sweep, stage), cost_table(sweep, stage)];
    for table in tables.iter().flatten() {
        push_table(html, table);
    }
    html.push_str("</section>\n");
}

/// The photo, the point under the pointer, and the front.
fn push_film(html: &mut String, front: &[&Point], pictures: &Pictures) {
    let of = |point: &Point| pictures.points.get(&point.name);
    let (Some(photo), Some(first)) = (&pictures.photo, front.iter().find_map(|p| of(p))) else {
        return;
    };
    html.push_str("<div class=\"film\">\n");
    let photo_caption = format!("photo {}, held out", pictures.view);
    push_figure(html, "photo", photo, &photo_caption);
    push_figure(html, "shown", first, "point at a dot to see it here");
    for point in front {
        if let (Some(jpeg), Some(seconds)) = (of(point), point.seconds()) {
            push_figure(
                html,
                "",
                jpeg,
                &format!("{}, {seconds:.1} s", point.label()),
            );
        }
    }
    html.push_str("</div>\n");
}

fn push_figure(html: &mut String, class: &str, jpeg: &[u8], caption: &str) {
    let _ = writeln!(
        html,
        "<figure class=\"{class}\"><img src=\"{}\" alt=\"\"><figcaption>{}</figcaption></figure>",
        source(jpeg),
        escaped(caption)
    );
}

fn source(jpeg: &[u8]) -> String {
    format!("data:image/jpeg;base64,{}", BASE64_STANDARD.encode(jpeg))
}

/// Every point of a stage, with what reproduces it.
fn push_points(html: &mut String, sweep: &Tradeoff, stage: PointStage, pictures: &Pictures) {
    if sweep.of(stage).next().is_none() {
        return;
    }
    let measures = measures(sweep, stage);
    let (title, stages): (_, &[&str]) = match stage {
        PointStage::Luma => ("All points of luma", &["load", "train", "measure"]),
        PointStage::Color => (
            "All points in color",
            &["luma", "teacher", "distill", "bake and measure"],
        ),
    };
    let _ = write!(
        html,
        "<h2>{title}</h2>\n<div class=\"scroll\"><table>\n<thead><tr><th></th><th class=\"words\">point</th><th>seconds</th>"
    );
    let owned = |words: &[&str]| {
        words
            .iter()
            .map(|&word| word.to_owned())
            .collect::<Vec<_>>()
    };
    let titles = measures.iter().map(|measure| measure.title()).collect();
    let rest = owned(&["Gaussians", "device MiB", "host MiB", ""]);
    for head in [owned(stages), titles, rest].concat() {
        let _ = write!(html, "<th>{head}</th>");
    }
    html.push_str("</tr></thead>\n<tbody>\n");
    for point in sweep.of(stage) {
        push_point(html, point, &measures, stages.len(), pictures);
    }
    html.push_str("</tbody></table></div>\n<p class=\"note\">One click on a command selects it.");
    html.push_str(match stage {
        PointStage::Luma => "</p>\n",
        PointStage::Color => {
            " The folder of a point in color begins with the base's <code>luma.ply</code> and <code>report.json</code>, which the base's command makes again.</p>\n"
        }
    });
}

fn push_point(
    html: &mut String,
    point: &Point,
    measures: &[Measure],
    stages: usize,
    pictures: &Pictures,
) {
    let label = escaped(&point.label());
    let picture = pictures
        .points
        .get(&point.name)
        .map_or(String::new(), |jpeg| {
            format!("<img src=\"{}\" alt=\"\">", source(jpeg))
        });
    let _ = write!(
        html,
        "<tr id=\"point-{}\" data-label=\"{label}\"><td class=\"small\">{picture}</td><td class=\"words\">{label}</td>",
        escaped(&point.name)
    );
    match &point.outcome {
        Some(outcome) => {
            let s = &outcome.seconds;
            let each = match point.stage {
                PointStage::Luma => vec![s.load, s.train, s.measure],
                PointStage::Color => {
                    vec![s.load + s.train + s.measure, s.teacher, s.distill, s.bake]
                }
            };
            let seconds = std::iter::once(s.total).chain(each);
            let cells = seconds
                .map(|seconds| format!("{seconds:.1}"))
                .chain(measures.iter().map(|&measure| figure(measure, outcome)))
                .chain([
                    outcome.splats.to_string(),
                    memory(outcome.peak_device_memory),
                    memory(outcome.peak_host_memory),
                ]);
            for cell in cells {
                let _ = write!(html, "<td>{cell}</td>");
            }
        }
        None => {
            let reason = point.failed.as_deref().unwrap_or_default();
            let _ = write!(
                html,
                "<td class=\"words failed\" colspan=\"{}\">failed: {}</td>",
                4 + stages + measures.len(),
                escaped(reason)
            );
        }
    }
    html.push_str("<td><details><summary>commands</summary>");
    for command in &point.commands {
        let _ = write!(html, "<code>{}</code>", escaped(&shell_line(command)));
    }
    html.push_str("</details></td></tr>\n");
}

#[cfg(test)]
mod tests {
    use super::super::tests::{failed, luma, sweep};
    use super::*;

    #[test]
    fn everything_is_on_the_page_and_nothing_breaks_it() {
        let mut odd = failed("sh-degree-3", "no <memory> & more");
        odd.commands = vec![vec!["fit".into(), "/my <scene>".into()]];
        let sweep = sweep(vec![
            luma("base", 10.0, 24.0),
            luma("coarse-0.5", 8.0, 23.0),
            odd,
        ]);
        let pictures = Pictures {
            view: "<a>.jpg".to_owned(),
            photo: Some(vec![1]),
            points: BTreeMap::from([("base".to_owned(), vec![2, 3])]),
        };
        let html = page(&sweep, &pictures);
        for piece in [
            "&lt;garden&gt;: what quality costs",
            "data:image/jpeg;base64,AQ==",
            "id=\"point-coarse-0.5\"",
            "no &lt;memory&gt; &amp; more",
            "gs-chroma fit '/my &lt;scene&gt;'",
            "What each knob of luma costs",
            "&lt;a&gt;.jpg",
        ] {
            assert!(html.contains(piece), "{piece}");
        }
        for piece in [
            "<garden>",
            "<memory>",
            "<scene>",
            "All points in color",
            "<script src",
        ] {
            assert!(!html.contains(piece), "{piece}");
        }
        assert_eq!(html.matches("<svg").count(), 2);
        assert!(html.len() < 30_000, "{}", html.len());
    }

    #[test]
    fn a_page_of_nothing() {
        let html = page(&sweep(Vec::new()), &Pictures::default());
        assert!(html.contains("0 points") && !html.contains("<section>"));
    }
}
