//! Quality that more or less time would give: the sentence that a sweep ends with.

use super::sweep::{Measure, PointStage, Tradeoff};

/// Times that differ by this share are the same.
const SAME: f64 = 0.1;

/// Gain of twice the base's seconds and loss of half of them, in words; `None` where no point
/// reaches either.
pub(super) fn sentence(sweep: &Tradeoff, stage: PointStage) -> Option<String> {
    let measure = sweep.measures(stage).next()?;
    let base = sweep.base(stage)?.place(measure)?[0];
    let places = sweep.of(stage).filter_map(|point| point.place(measure));
    in_words(places.collect(), base, measure)
}

/// The same for points of seconds and, larger where it is better, merit.
fn in_words(mut places: Vec<[f64; 2]>, base: f64, measure: &Measure) -> Option<String> {
    places.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let now = merit_at(&places, base)?;
    let unit = measure.unit();
    let said = |difference: f64| match difference < 0.05 {
        true => "nothing".to_owned(),
        false => format!("{difference:.1} {unit}"),
    };
    let twice = merit_at(&places, 2.0 * base).map(|merit| said(merit - now));
    let half = merit_at(&places, 0.5 * base).map(|merit| said(now - merit));
    match (twice, half) {
        (Some(gain), Some(loss)) => Some(format!("twice the time buys {gain}, half costs {loss}")),
        (Some(gain), None) => Some(format!("twice the time buys {gain}")),
        (None, Some(loss)) => Some(format!("half the time costs {loss}")),
        (None, None) => None,
    }
}

/// Best merit that so many seconds give by points sorted by seconds, linear in their logarithm
/// between two of the front; `None` outside of what was measured.
fn merit_at(places: &[[f64; 2]], seconds: f64) -> Option<f64> {
    let longest = places.last()?[0];
    let mut before: Option<[f64; 2]> = None;
    for &[x, merit] in places {
        match before {
            // On no front: slower, and no better.
            Some([_, best]) if merit <= best => {}
            Some([start, best]) if x >= seconds => {
                let share = (seconds / start).ln() / (x / start).ln();
                return Some(best + (merit - best) * share);
            }
            None if x > seconds * (1.0 + SAME) => return None,
            _ => before = Some([x, merit]),
        }
    }
    let [_, best] = before?;
    (seconds <= longest * (1.0 + SAME)).then_some(best)
}

#[cfg(test)]
mod tests {
    use super::super::sweep::MEASURES;
    use super::*;

    fn said(places: &[[f64; 2]], base: f64) -> Option<String> {
        in_words(places.to_vec(), base, &MEASURES[0])
    }

    #[test]
    fn between_two_points_of_the_front_by_the_logarithm_of_time() {
        // 2 dB for four times the time: 1 dB for each doubling.
        let front = [[10.0, 22.0], [40.0, 24.0], [160.0, 25.0]];
        let words = "twice the time buys 0.5 dB, half costs 1.0 dB";
        assert_eq!(said(&front, 40.0).as_deref(), Some(words));
        assert_eq!(merit_at(&front, 20.0), Some(23.0));
        // In any order; a point that is slower and worse changes nothing.
        let beside = [
            [160.0, 25.0],
            [20.0, 21.0],
            [10.0, 22.0],
            [40.0, 24.0],
            [81.0, 23.9],
        ];
        assert_eq!(said(&beside, 40.0).as_deref(), Some(words));
    }

    /// The base itself is off the front, and more time makes it worse.
    #[test]
    fn a_curve_that_falls() {
        let falling = [[10.0, 22.0], [20.0, 25.0], [40.0, 24.0], [80.0, 23.0]];
        let words = "twice the time buys nothing, half costs nothing";
        assert_eq!(said(&falling, 40.0).as_deref(), Some(words));
    }

    #[test]
    fn nothing_is_said_where_nothing_was_measured() {
        assert_eq!(said(&[[40.0, 24.0]], 40.0), None);
        assert_eq!(
            said(&[[30.0, 23.0], [40.0, 24.0], [60.0, 24.5]], 40.0),
            None
        );
        let short = [[15.0, 22.0], [40.0, 24.0]];
        assert_eq!(
            said(&short, 40.0).as_deref(),
            Some("half the time costs 1.4 dB")
        );
        let long = [[40.0, 24.0], [78.0, 25.0]];
        assert_eq!(
            said(&long, 40.0).as_deref(),
            Some("twice the time buys 1.0 dB")
        );
    }
}
