//! Quality that more or less time would give: the sentence that a sweep ends with.

use super::sweep::{PointStage, SweepPoint, Tradeoff};

/// Times that differ by this share are the same.
const SAME: f64 = 0.1;

/// Least factor on the base's time of which something is said.
const WORTH_SAYING: f64 = 1.5;

/// Gain of twice the base's seconds and loss of half of them, in words; `None` where no point
/// reaches either.
pub(super) fn sentence(sweep: &Tradeoff, stage: PointStage) -> Option<String> {
    let measure = sweep.measures(stage).next()?;
    let [base, _] = sweep.base(stage)?.place(measure)?;
    let placed = |point: &SweepPoint| point.place(measure);
    let front: Vec<[f64; 2]> = (sweep.front(stage, measure).into_iter())
        .filter_map(placed)
        .collect();
    let all = sweep.of(stage).filter_map(placed);
    let longest = all.fold(0.0, |longest, [seconds, _]| seconds.max(longest));
    let now = merit_at(&front, base)?;
    let unit = measure.unit();
    let said = |difference: f64| match difference < 0.05 {
        true => "nothing".to_owned(),
        false => format!("{difference:.1} {unit}"),
    };
    // What takes twice the iterations may take a little less than twice the time.
    let more = (longest / base).min(2.0);
    let times = match more * (1.0 + SAME) >= 2.0 {
        true => "twice".to_owned(),
        false => format!("{more:.1} times"),
    };
    let twice = merit_at(&front, more * base).filter(|_| more >= WORTH_SAYING);
    let twice = twice.map(|merit| format!("{times} the time buys {}", said(merit - now)));
    let half = merit_at(&front, 0.5 * base).map(|merit| said(now - merit));
    match (twice, half) {
        (Some(gain), Some(loss)) => Some(format!("{gain}, half costs {loss}")),
        (gain @ Some(_), None) => gain,
        (None, Some(loss)) => Some(format!("half the time costs {loss}")),
        (None, None) => None,
    }
}

/// Best merit that so many seconds give, linear in their logarithm between two points of the
/// front and beyond its end the last; `None` before its beginning.
fn merit_at(front: &[[f64; 2]], seconds: f64) -> Option<f64> {
    let after = front.partition_point(|[x, _]| *x < seconds);
    match (front[..after].last(), front.get(after)) {
        (Some([x, merit]), Some([end, best])) => {
            Some(merit + (best - merit) * (seconds / x).ln() / (end / x).ln())
        }
        (Some([_, best]), None) => Some(*best),
        (None, Some([x, merit])) => (*x <= seconds * (1.0 + SAME)).then_some(*merit),
        (None, None) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{luma, sweep};
    use super::*;

    /// What is said of a base and other points.
    fn said(base: [f64; 2], others: &[[f64; 2]]) -> Option<String> {
        let mut points = vec![luma("base", base[0], base[1])];
        points.extend(others.iter().map(|&[x, y]| luma("side-1", x, y)));
        sentence(&sweep(points), PointStage::Luma)
    }

    #[test]
    fn between_two_points_of_the_front_by_the_logarithm_of_time() {
        // 2 dB for four times the time: 1 dB for each doubling.
        let front = [[160.0, 25.0], [10.0, 22.0]];
        let words = Some("twice the time buys 0.5 dB, half costs 1.0 dB");
        assert_eq!(said([40.0, 24.0], &front).as_deref(), words);
        // Points that are slower and worse change nothing.
        let beside = [[160.0, 25.0], [20.0, 21.0], [10.0, 22.0], [81.0, 23.9]];
        assert_eq!(said([40.0, 24.0], &beside).as_deref(), words);
    }

    /// The base itself is off the front, and more time makes it worse.
    #[test]
    fn a_curve_that_falls() {
        let falling = [[10.0, 22.0], [20.0, 25.0], [80.0, 23.0]];
        let words = "twice the time buys nothing, half costs nothing";
        assert_eq!(said([40.0, 24.0], &falling).as_deref(), Some(words));
    }

    #[test]
    fn nothing_is_said_where_nothing_was_measured() {
        let said = |others: &[[f64; 2]]| said([40.0, 24.0], others);
        assert_eq!(said(&[]), None);
        assert_eq!(said(&[[30.0, 23.0], [50.0, 24.5]]), None);
        let half = said(&[[15.0, 22.0]]);
        assert_eq!(half.as_deref(), Some("half the time costs 1.4 dB"));
        let twice = said(&[[78.0, 25.0]]);
        assert_eq!(twice.as_deref(), Some("twice the time buys 1.0 dB"));
        let less = said(&[[64.0, 25.0]]);
        assert_eq!(less.as_deref(), Some("1.6 times the time buys 1.0 dB"));
    }
}
