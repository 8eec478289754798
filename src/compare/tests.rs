//! Every comparator is fed wrong answers and has to refuse them.

use super::*;

/// Expected values of either sign and of sizes from 0.002 to 2.
fn expected() -> Vec<f64> {
    (0..1000)
        .map(|i| f64::from(i) * 0.7)
        .map(|angle| angle.sin() * 2.0_f64.powf(10.0 * (angle * 0.01).cos() - 9.0))
        .collect()
}

/// The expected values with rounding errors as an `f32` kernel makes them.
fn right() -> Vec<f64> {
    expected().iter().map(|&e| f64::from(e as f32)).collect()
}

fn wrong_answers() -> Vec<(&'static str, Vec<f64>)> {
    let with = |change: fn(usize, f64) -> f64| -> Vec<f64> {
        (right().into_iter().enumerate())
            .map(|(i, v)| change(i, v))
            .collect()
    };
    vec![
        ("sign flipped", with(|_, v| -v)),
        (
            "one element off",
            with(|i, v| v + f64::from(u8::from(i == 400))),
        ),
        ("a NaN", with(|i, v| if i == 999 { f64::NAN } else { v })),
        (
            "an infinity",
            with(|i, v| if i == 0 { f64::INFINITY } else { v }),
        ),
        ("a constant bias", with(|_, v| v + 0.01)),
        ("scaled by 1.01", with(|_, v| v * 1.01)),
        ("all zero", with(|_, _| 0.0)),
        ("one short", right()[1..].to_vec()),
        ("nothing", Vec::new()),
    ]
}

const TIGHT: Elementwise = Elementwise {
    absolute: 1e-7,
    relative: 1e-6,
};

fn refuses_all(check: impl Fn(&[f64], &[f64]) -> Result<(), String>, blind_to: &[&str]) {
    let expected = expected();
    check(&right(), &expected).expect("the right answer must pass");
    check(&expected, &expected).expect("the same answer must pass");
    for (name, actual) in wrong_answers() {
        let passed = check(&actual, &expected).is_ok();
        assert_eq!(passed, blind_to.contains(&name), "{name}");
    }
    assert!(check(&[], &[]).is_err(), "nothing proves nothing");
    let nan = [f64::NAN];
    assert!(check(&nan, &nan).is_err(), "NaN is not equal to NaN");
    assert!(check(&[0.0; 3], &[0.0; 3]).is_ok(), "zero is zero");
    assert!(check(&[1.0; 3], &[0.0; 3]).is_err(), "something for zero");
}

#[test]
fn elementwise_refuses_wrong_answers() {
    refuses_all(|a, e| TIGHT.compare(a, e).check(), &[]);
}

#[test]
fn elementwise_names_the_worst() {
    let bound = Elementwise {
        absolute: 0.1,
        relative: 0.0,
    };
    let figures = bound.compare(&[1.0, 2.2, 3.5, 4.0], &[1.0, 2.0, 3.0, 4.0]);
    assert_eq!((figures.worst, figures.expected), (2, 3.0));
    assert!((figures.used - 5.0).abs() < 1e-12);
    assert!((figures.largest_error - 0.5).abs() < 1e-12);
    let line = figures.check().unwrap_err();
    assert!(
        line.contains("[2]") && line.contains("5.000 times"),
        "{line}"
    );
}

#[test]
fn relative_l2_refuses_wrong_answers() {
    refuses_all(|a, e| relative_l2(a, e, 1e-6).check(), &[]);
    let figure = relative_l2(&[1.01, 2.02], &[1.0, 2.0], 0.02);
    assert!((figure.value - 0.01).abs() < 1e-12);
}

#[test]
fn cosine_refuses_all_but_another_length() {
    refuses_all(|a, e| cosine(a, e, 1e-12).check(), &["scaled by 1.01"]);
    assert!((cosine(&[1.0, 0.0], &[0.0, 3.0], 0.1).value - 1.0).abs() < 1e-12);
    assert!((cosine(&[-1.0, 0.0], &[3.0, 0.0], 0.1).value - 2.0).abs() < 1e-12);
}

#[test]
fn signed_bias_refuses_wrong_answers() {
    refuses_all(|a, e| signed_bias(a, e, 1e-6).check(), &[]);
    let figures = signed_bias(&[1.5, -0.5], &[1.0, -1.0], 1.0);
    assert_eq!((figures.offset.value, figures.gain.value), (0.5, 0.0));
    let figures = signed_bias(&[1.5, -1.5], &[1.0, -1.0], 1.0);
    assert_eq!((figures.offset.value, figures.gain.value), (0.0, 0.5));
    // Errors that average out are for the others to find.
    assert!(signed_bias(&[1.5, 0.5], &[1.0, 1.0], 1e-9).check().is_ok());
}

#[test]
fn negative_bias_fails_too() {
    let lower: Vec<_> = right().iter().map(|v| v - 0.01).collect();
    assert!(signed_bias(&lower, &expected(), 1e-6).check().is_err());
    let shorter: Vec<_> = right().iter().map(|v| v * 0.99).collect();
    assert!(signed_bias(&shorter, &expected(), 1e-3).check().is_err());
}

#[test]
fn gradient_bounds_refuse_wrong_answers_and_say_all() {
    let bounds = GradientBounds {
        elementwise: TIGHT,
        relative_l2: 1e-6,
        cosine: 1e-12,
        signed_bias: 1e-6,
    };
    refuses_all(|a, e| bounds.compare(a, e).check(), &[]);
    let flipped: Vec<_> = right().iter().map(|v| -v).collect();
    let line = bounds.compare(&flipped, &expected()).check().unwrap_err();
    for name in ["elementwise", "relative L2", "cosine", "signed bias"] {
        assert!(line.contains(name), "{line}");
    }
}

const FLIPS: FlipBounds = FlipBounds {
    rest: TIGHT,
    jump: Elementwise {
        absolute: 0.05,
        relative: 0.0,
    },
    cap: 0.02,
};

#[test]
fn flips_refuse_wrong_answers() {
    let check = |a: &[f64], e: &[f64]| FLIPS.compare(a, e, &vec![true; e.len()]).check();
    refuses_all(check, &[]);
}

/// The right answer with the given elements moved.
fn flipped(moved: impl Iterator<Item = (usize, f64)>) -> Vec<f64> {
    let mut actual = right();
    moved.for_each(|(i, by)| actual[i] += by);
    actual
}

#[test]
fn a_few_even_flips_at_discontinuities_pass() {
    let moved = (0..20).map(|i| (i * 50, if i % 2 == 0 { 0.01 } else { -0.01 }));
    let actual = flipped(moved);
    let near: Vec<_> = (0..1000).map(|i| i % 50 == 0).collect();
    let figures = FLIPS.compare(&actual, &expected(), &near);
    figures.check().expect("twenty of a thousand are allowed");
    assert_eq!((figures.up, figures.down, figures.share), (10, 10, 0.02));
    assert!(figures.rest_used > 0.0 && figures.rest_used <= 1.0);
}

#[test]
fn flips_fail_in_every_way_they_can() {
    let everywhere = vec![true; 1000];
    let refused = |actual: &[f64], near: &[bool]| {
        let figures = FLIPS.compare(actual, &expected(), near);
        figures.check().expect_err("must fail")
    };
    let even = |i: usize| if i.is_multiple_of(2) { 0.01 } else { -0.01 };

    let many = flipped((0..22).map(|i| (i * 40, even(i))));
    assert!(refused(&many, &everywhere).contains("share"));
    let lopsided = flipped((0..20).map(|i| (i * 50, 0.01)));
    assert!(refused(&lopsided, &everywhere).contains("20 up and 0 down"));
    let far = flipped([(7, 0.06)].into_iter());
    assert!(refused(&far, &everywhere).contains("[7] jumps"));
    let astray = flipped([(7, 0.01)].into_iter());
    assert!(refused(&astray, &vec![false; 1000]).contains("[7] is out"));
    assert!(refused(&right(), &everywhere[1..]).contains("marks"));
}

#[test]
fn widening_is_exact() {
    assert_eq!(widen(&[0.1, -3.5]), [f64::from(0.1_f32), -3.5]);
}
