//! `tradeoff.csv`: a row a point.

use super::{Measure, Point, Tradeoff, shell_line};

/// Column names with their units, and what is in them.
type Column = (&'static str, fn(&Tradeoff, &Point) -> String);

const COLUMNS: [Column; 26] = [
    ("name", |_, point| point.name.clone()),
    ("stage", |_, point| point.stage.name().to_owned()),
    ("phase", |_, point| point.phase.name().to_owned()),
    ("settings", |_, point| {
        let settings = point.settings.iter();
        let words: Vec<String> = settings
            .map(|setting| format!("{}={}", setting.knob, setting.value))
            .collect();
        words.join(" ")
    }),
    ("on_front", |sweep, point| {
        on_front(sweep, point).to_string()
    }),
    ("iterations", |_, p| of(p, |o| Some(o.iterations))),
    ("splats", |_, p| of(p, |o| Some(o.splats))),
    ("seconds", |_, p| of(p, |o| seconds(o.seconds.total))),
    ("load_seconds", |_, p| of(p, |o| seconds(o.seconds.load))),
    ("train_seconds", |_, p| of(p, |o| seconds(o.seconds.train))),
    ("measure_seconds", |_, p| {
        of(p, |o| seconds(o.seconds.measure))
    }),
    ("teacher_seconds", |_, p| {
        of(p, |o| seconds(o.seconds.teacher))
    }),
    ("distill_seconds", |_, p| {
        of(p, |o| seconds(o.seconds.distill))
    }),
    ("bake_seconds", |_, p| of(p, |o| seconds(o.seconds.bake))),
    ("took_seconds", |_, p| format!("{:.3}", p.took)),
    ("psnr_db", |_, p| of(p, |o| o.psnr)),
    ("corrected_psnr_db", |_, p| of(p, |o| o.corrected_psnr)),
    ("ssim", |_, p| of(p, |o| o.ssim)),
    ("delta_e00", |_, p| of(p, |o| o.delta_e)),
    ("consistency_lab", |_, p| of(p, |o| o.consistency)),
    ("colorfulness", |_, p| of(p, |o| o.colorfulness)),
    ("teacher_colorfulness", |_, p| {
        of(p, |o| o.teacher_colorfulness)
    }),
    ("peak_host_bytes", |_, p| of(p, |o| o.peak_host_memory)),
    ("peak_device_bytes", |_, p| of(p, |o| o.peak_device_memory)),
    ("failed", |_, point| {
        point.failed.clone().unwrap_or_default()
    }),
    ("commands", |_, point| {
        let lines: Vec<String> = point.commands.iter().map(|c| shell_line(c)).collect();
        lines.join(" && ")
    }),
];

/// The table as RFC 4180 has it, but for the ends of lines.
pub fn csv(sweep: &Tradeoff) -> String {
    let header: Vec<&str> = COLUMNS.iter().map(|(name, _)| *name).collect();
    let mut text = header.join(",") + "\n";
    for point in &sweep.points {
        let cells: Vec<String> = (COLUMNS.iter())
            .map(|(_, cell)| quoted(cell(sweep, point)))
            .collect();
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// A figure of the outcome; empty without.
fn of<T: ToString>(point: &Point, value: fn(&super::Outcome) -> Option<T>) -> String {
    let value = point.outcome.as_ref().and_then(value);
    value.map_or(String::new(), |value| value.to_string())
}

fn seconds(seconds: f64) -> Option<String> {
    Some(format!("{seconds:.3}"))
}

/// Whether a point is on the front of one of its stage's measures.
fn on_front(sweep: &Tradeoff, point: &Point) -> bool {
    Measure::of(point.stage).iter().any(|&measure| {
        let front = sweep.front(point.stage, measure);
        front.iter().any(|found| found.name == point.name)
    })
}

fn quoted(cell: String) -> String {
    match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell,
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{failed, luma, sweep};
    use super::*;

    #[test]
    fn a_row_a_point_and_quotes_where_needed() {
        let mut odd = failed("odd", "no \"room\", none\nat all");
        odd.commands = vec![vec!["fit".into(), "/a,b".into()], vec!["eval".into()]];
        let text = csv(&sweep(vec![luma("base", 10.0, 24.5), odd]));
        let (header, rows) = text.split_once('\n').expect("a header");
        assert_eq!(header.split(',').count(), COLUMNS.len());
        let (base, odd) = rows.split_once('\n').expect("two rows");
        assert_eq!(base.split(',').count(), COLUMNS.len());
        assert!(
            base.starts_with("base,luma,base,,true,700,1000,10.000,"),
            "{base}"
        );
        assert!(base.contains(",24.5,"), "{base}");
        let end = "\"no \"\"room\"\", none\nat all\",\"gs-chroma fit /a,b && gs-chroma eval\"\n";
        assert!(odd.starts_with("odd,luma,one,,false,,,,"), "{odd}");
        assert!(odd.ends_with(end), "{odd}");
    }
}
