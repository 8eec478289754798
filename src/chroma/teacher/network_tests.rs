use super::*;

#[test]
fn noise_is_normal_and_always_the_same() {
    let values = noise(20_000, 0.5);
    assert_eq!(values[..119], noise(119, 0.5));
    let mean = |power: i32| {
        let powers = values.iter().map(|v| f64::from(*v).powi(power));
        powers.sum::<f64>() / values.len() as f64
    };
    // Moments of a normal distribution: 0, σ², 0, 3 σ⁴.
    for (power, expected) in [(1, 0.0), (2, 0.25), (3, 0.0), (4, 0.1875)] {
        let found = mean(power);
        assert!((found - expected).abs() < 0.01, "{power}: {found}");
    }
}
