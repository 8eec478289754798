//! The sweep for people: `tradeoff.html` and the table that is printed.

use std::fmt::Write;

use super::{
    plot::plot,
    sweep::{Measure, PointStage, SweepPoint, Tradeoff},
    worth,
};
use crate::report::{
    Table,
    html::{TAIL, escaped, head, push_table},
};

/// The front of a stage, and what more or less time would give; `None` without points.
pub fn front_table(sweep: &Tradeoff, stage: PointStage) -> Option<Table> {
    let front = sweep.best(stage);
    let title = match stage {
        PointStage::Luma => "Luma: the best that each time buys",
        PointStage::Color => "Color: the best that each time buys",
    };
    let mut table = (!front.is_empty()).then(|| table(sweep, stage, title, &front))?;
    let said = worth::sentence(sweep, stage).map(|said| format!("Around the base {said}."));
    table.notes.extend(said);
    Some(table)
}

/// Points in figures, reasons of failures as notes; gains of the measure that decides.
fn table(sweep: &Tradeoff, stage: PointStage, title: &str, points: &[&SweepPoint]) -> Table {
    let measures: Vec<&Measure> = sweep.measures(stage).collect();
    let row = |point: &&SweepPoint| {
        let other = sweep.reference(point);
        let mut row = vec![point.label()];
        if let Some(small) = other.filter(|other| other.settings.len() > 1) {
            row[0] += &format!(", for its sign, against {}", small.label());
        }
        let base = other.and_then(|base| base.outcome.as_ref());
        match &point.outcome {
            Some(outcome) => {
                row.push(format!("{:.1}", outcome.seconds));
                row.push(base.map_or(String::new(), |base| {
                    format!("{:.2}", outcome.seconds / base.seconds.max(1e-9))
                }));
                row.push(measures[0].gain(outcome, base));
                row.extend(measures.iter().map(|measure| measure.figure(outcome)));
                row.push(outcome.splats.to_string());
                for memory in [outcome.peak_device_memory, outcome.peak_host_memory] {
                    row.push(memory.map_or(String::new(), |bytes| (bytes >> 20).to_string()));
                }
            }
            None => {
                row.push("failed".to_owned());
                row.resize(7 + measures.len(), String::new());
            }
        }
        row
    };
    let titles = measures.iter().map(|measure| measure.title);
    let head = ["point", "seconds", "× base", "gain"]
        .into_iter()
        .chain(titles);
    let head = head.chain(["Gaussians", "device MiB", "host MiB"]);
    let reason = |point: &&SweepPoint| {
        let reason = point.failed.as_deref()?;
        Some(format!("{} failed: {reason}", point.label()))
    };
    let measured = "Measured on held-out views.".to_owned();
    Table {
        title: title.to_owned(),
        head: head.map(str::to_owned).collect(),
        rows: points.iter().map(row).collect(),
        notes: (std::iter::once(measured).chain(points.iter().filter_map(reason))).collect(),
    }
}

/// Style of this page, besides that of all pages.
const STYLE: &str = "<style>
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(380px, 1fr)); gap: 1rem; }
.plots svg { display: block; max-width: 100%; height: auto; color: var(--ink); fill: var(--quiet); background: var(--card); }
pre { white-space: pre-wrap; overflow-wrap: anywhere; font-size: .78rem; }
</style>
";

/// `tradeoff.html`; pictures are those in the points' folders.
pub(super) fn page(sweep: &Tradeoff) -> String {
    let mut html = head("gs-chroma trade-off") + STYLE;
    let subject = &sweep.subject;
    let scene = subject.scene.rsplit(['/', '\\']).next().unwrap_or_default();
    let teacher = subject.teacher.as_ref();
    // Writing to a string cannot fail.
    let _ = writeln!(
        html,
        "<h1>{}: what quality costs in time</h1>\n<p class=\"note\">gs-chroma {}; {}{}{}; {} points in {:.1} of {:.1} minutes.</p>",
        escaped(scene),
        escaped(&sweep.program),
        escaped(&shell_line(
            &[&["fit".to_owned()], &subject.options[..]].concat()
        )),
        teacher.map_or(String::new(), |path| format!("; teacher {}", escaped(path))),
        (sweep.device.as_ref()).map_or(String::new(), |name| format!("; {}", escaped(name))),
        sweep.points.len(),
        sweep.spent() / 60.0,
        sweep.limit() / 60.0,
    );
    for stage in PointStage::ALL {
        push_stage(&mut html, sweep, stage);
    }
    html.push_str("<h2>Commands</h2>\n<pre>");
    for command in sweep.points.iter().flat_map(|point| &point.commands) {
        let _ = writeln!(html, "{}", escaped(&shell_line(command)));
    }
    html + "</pre>\n" + TAIL
}

/// A stage's plots, its front in pictures and figures, and all of its points.
fn push_stage(html: &mut String, sweep: &Tradeoff, stage: PointStage) {
    let Some(front) = front_table(sweep, stage) else {
        return;
    };
    html.push_str("<div class=\"plots\">\n");
    for measure in sweep.measures(stage) {
        html.push_str(&plot(sweep, stage, measure));
    }
    html.push_str("</div>\n");
    push_table(html, &front);
    html.push_str("<div class=\"row\">\n");
    let seconds = |point: &SweepPoint| point.outcome.as_ref().map_or(0.0, |o| o.seconds);
    let mut points: Vec<&SweepPoint> = sweep.of(stage).collect();
    points.sort_by(|a, b| seconds(a).total_cmp(&seconds(b)));
    let first = sweep.measures(stage).next();
    for point in &points {
        let (Some(picture), Some(outcome)) = (&point.picture, &point.outcome) else {
            continue;
        };
        let _ = writeln!(
            html,
            "<figure><a href=\"{picture}\"><img src=\"{picture}\" alt=\"\" loading=\"lazy\"></a><figcaption>{}: {:.1} s{}</figcaption></figure>",
            escaped(&point.label()),
            outcome.seconds,
            first.map_or(String::new(), |measure| measure.in_words(outcome)),
            picture = escaped(picture),
        );
    }
    html.push_str("</div>\n");
    push_table(html, &table(sweep, stage, "All points", &points));
}

/// The program with these arguments, quoted for a POSIX shell.
pub fn shell_line(arguments: &[impl AsRef<str>]) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    let mut line = String::from("gs-chroma");
    for argument in arguments.iter().map(AsRef::as_ref) {
        // In single quotes where the shell would see more than a word.
        line += &match !argument.is_empty() && argument.chars().all(plain) {
            true => format!(" {argument}"),
            false => format!(" '{}'", argument.replace('\'', r"'\''")),
        };
    }
    line
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{failed, luma, sweep};
    use super::*;

    #[test]
    fn everything_is_on_the_page_and_nothing_breaks_it() {
        let mut odd = failed("sh-degree-3", "no <memory> & more");
        odd.commands = vec![vec!["fit".into(), "/my <scene>".into()]];
        let look = SweepPoint {
            after: Some(350),
            picture: Some("points/base/album/350.png".to_owned()),
            settings: Vec::new(),
            ..luma("base+after-350", 5.0, 23.0)
        };
        let sweep = sweep(vec![luma("base", 10.0, 24.0), look, odd]);
        let table = front_table(&sweep, PointStage::Luma).expect("points");
        let rows: Vec<String> = table.rows.iter().map(|row| row[..5].join(" ")).collect();
        let before = "base, after 350 iterations 5.0 0.50 -1.00 23.00";
        assert_eq!(rows, [before, "base 10.0 1.00 +0.00 24.00"]);
        let said = "Around the base half the time costs 1.0 dB.";
        assert_eq!(table.notes[1], said);
        assert!(front_table(&sweep, PointStage::Color).is_none());
        let html = page(&sweep);
        for piece in [
            "&lt;garden&gt;: what quality costs",
            "gs-chroma fit --channel r;",
            "src=\"points/base/album/350.png\"",
            said,
            "no &lt;memory&gt; &amp; more",
            "gs-chroma fit '/my &lt;scene&gt;'",
        ] {
            assert!(html.contains(piece), "{piece}");
        }
        for piece in ["<garden>", "<memory>", "<scene>", "<script"] {
            assert!(!html.contains(piece), "{piece}");
        }
        assert_eq!(html.matches("<svg").count(), 2);
    }

    /// The line as the shell itself splits it.
    #[cfg(unix)]
    #[test]
    fn a_shell_reads_the_same_arguments() {
        let words = [
            "fit",
            "/a b/ü",
            "it's",
            "\"$HOME\" `id`",
            "\\",
            "a\nb",
            "",
            "*",
        ];
        let words = words.map(str::to_owned);
        let line = shell_line(&words).replacen("gs-chroma", r"printf '%s|'", 1);
        let done = std::process::Command::new("sh")
            .arg("-c")
            .arg(line)
            .output();
        let printed = String::from_utf8(done.expect("a shell").stdout).expect("text");
        assert_eq!(printed, words.map(|word| word + "|").concat());
        assert_eq!(shell_line(&["--a=1,2".to_owned()]), "gs-chroma --a=1,2");
    }
}
