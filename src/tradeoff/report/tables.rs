//! The sweep in tables.

use super::{Measure, Outcome, Phase, Point, PointStage, Tradeoff};
use crate::report::Table;

/// The front of a stage, for the terminal and the page; `None` without points.
pub fn front_table(sweep: &Tradeoff, stage: PointStage) -> Option<Table> {
    let decisive = sweep.decisive(stage)?;
    let measures = measures(sweep, stage);
    let head = ["point", "seconds", "× base"]
        .map(str::to_owned)
        .into_iter();
    let base = sweep.base(stage).and_then(Point::seconds);
    let rows = sweep
        .front(stage, decisive)
        .into_iter()
        .filter_map(|point| {
            let outcome = point.outcome.as_ref()?;
            let seconds = outcome.seconds.total;
            let factor = base.map_or(String::new(), |base| format!("{:.2}", seconds / base));
            let mut row = vec![point.label(), format!("{seconds:.1}"), factor];
            row.extend(measures.iter().map(|&m| figure(m, outcome)));
            Some(row)
        });
    Some(Table {
        title: match stage {
            PointStage::Luma => "Luma: the best that each time buys".to_owned(),
            PointStage::Color => "Color: the best that each time buys".to_owned(),
        },
        head: head.chain(titles(&measures)).collect(),
        rows: rows.collect(),
        notes: vec![format!("By {}.", decisive.name())],
    })
}

/// What each knob alone changes, relative to the base; `None` without points.
pub(super) fn cost_table(sweep: &Tradeoff, stage: PointStage) -> Option<Table> {
    let measures = measures(sweep, stage);
    let base = sweep.base(stage)?.outcome.as_ref()?;
    let mut rows: Vec<(&str, Vec<String>)> = (sweep.of(stage))
        .filter(|point| point.phase == Phase::One)
        .filter_map(|point| {
            let outcome = point.outcome.as_ref()?;
            let seconds = outcome.seconds.total;
            let mut row = vec![
                point.label(),
                format!("{seconds:.1}"),
                format!("{:+.1}", seconds - base.seconds.total),
                format!("{:.2}", seconds / base.seconds.total.max(1e-9)),
            ];
            row.extend(
                measures
                    .iter()
                    .map(|&measure| change(measure, outcome, base)),
            );
            row.push(memory(outcome.peak_device_memory));
            row.push(memory(outcome.peak_host_memory));
            Some((&point.settings.first()?.knob[..], row))
        })
        .collect();
    // A knob's values stand together.
    rows.sort_by_key(|(knob, _)| *knob);
    let head = ["turned", "seconds", "change", "× base"].map(str::to_owned);
    let memory = ["device MiB", "host MiB"].map(str::to_owned);
    (!rows.is_empty()).then(|| Table {
        title: match stage {
            PointStage::Luma => "What each knob of luma costs".to_owned(),
            PointStage::Color => "What each knob of color costs".to_owned(),
        },
        head: (head.into_iter())
            .chain(titles(&measures))
            .chain(memory)
            .collect(),
        rows: rows.into_iter().map(|(_, row)| row).collect(),
        notes: vec![base_in_words(&measures, base)],
    })
}

/// The measures that some point of a stage has.
pub(super) fn measures(sweep: &Tradeoff, stage: PointStage) -> Vec<Measure> {
    let has = |measure: &Measure| {
        (sweep.of(stage))
            .filter_map(|point| point.outcome.as_ref())
            .any(|outcome| measure.value(outcome).is_some())
    };
    (Measure::of(stage).iter().copied()).filter(has).collect()
}

/// A figure of an outcome; empty without.
pub(super) fn figure(measure: Measure, outcome: &Outcome) -> String {
    let digits = measure.digits();
    let value = measure.value(outcome);
    value.map_or(String::new(), |value| format!("{value:.digits$}"))
}

/// Bytes in MiB; empty where nobody tells.
pub(super) fn memory(bytes: Option<u64>) -> String {
    bytes.map_or(String::new(), |bytes| (bytes >> 20).to_string())
}

fn change(measure: Measure, outcome: &Outcome, base: &Outcome) -> String {
    let digits = measure.digits();
    match (measure.value(outcome), measure.value(base)) {
        (Some(value), Some(base)) => format!("{:+.digits$}", value - base),
        _ => String::new(),
    }
}

fn titles(measures: &[Measure]) -> impl Iterator<Item = String> {
    measures.iter().map(|measure| measure.title())
}

fn base_in_words(measures: &[Measure], base: &Outcome) -> String {
    let figures: Vec<String> = (measures.iter())
        .filter_map(|&measure| Some(measure.in_words(measure.value(base)?)))
        .collect();
    format!(
        "Relative to the base: {:.1} s, {}.",
        base.seconds.total,
        figures.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::super::tests::{failed, luma, sweep};
    use super::*;

    #[test]
    fn the_front_fastest_first_and_costs_by_knob() {
        let sweep = sweep(vec![
            luma("base", 10.0, 24.0),
            luma("iterations-350", 5.5, 22.5),
            failed("sh-3", "no memory"),
            luma("coarse-0.5", 12.0, 23.0),
            luma("iterations-1400", 20.0, 25.0),
        ]);
        let front = front_table(&sweep, PointStage::Luma).expect("points");
        let first: Vec<&str> = front.rows.iter().map(|row| &row[0][..]).collect();
        assert_eq!(first, ["iterations 350", "base", "iterations 1400"]);
        assert_eq!(front.rows[0][1..4], ["5.5", "0.55", "22.50"]);
        let cost = cost_table(&sweep, PointStage::Luma).expect("points");
        let first: Vec<&str> = cost.rows.iter().map(|row| &row[0][..]).collect();
        assert_eq!(first, ["coarse 0.5", "iterations 350", "iterations 1400"]);
        assert_eq!(cost.rows[0][1..5], ["12.0", "+2.0", "1.20", "-1.00"]);
        assert!(cost.rows.iter().all(|row| row.len() == cost.head.len()));
        assert!(front_table(&sweep, PointStage::Color).is_none());
        assert!(cost_table(&sweep, PointStage::Color).is_none());
    }
}
