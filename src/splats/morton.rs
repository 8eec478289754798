//! An order in which neighbors in space are neighbors in a file.

/// Bits of each axis: three of them fill a u64.
const BITS: u32 = 21;

/// The Gaussians along a Z-order curve through the box of their centers, `[N]`; those of one
/// place stay in order.
pub fn order(means: &[[f32; 3]]) -> Vec<u32> {
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for mean in means {
        for axis in 0..3 {
            low[axis] = low[axis].min(mean[axis]);
            high[axis] = high[axis].max(mean[axis]);
        }
    }
    let code = |mean: &[f32; 3]| {
        (0..3).fold(0, |code, axis| {
            let share =
                super::quantize::share(mean[axis].into(), low[axis].into(), high[axis].into());
            code | spread(super::quantize::level(share, (1 << BITS) - 1)) << axis
        })
    };
    let mut coded: Vec<(u64, u32)> = (means.iter().zip(0..))
        .map(|(mean, index)| (code(mean), index))
        .collect();
    coded.sort_unstable();
    coded.into_iter().map(|(_, index)| index).collect()
}

/// The bits of a number, two zeros after each.
fn spread(number: u32) -> u64 {
    (0..BITS).fold(0, |spread, bit| {
        spread | u64::from(number >> bit & 1) << (3 * bit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_visited_in_z_order() {
        let mut corners: Vec<[f32; 3]> = (0..8)
            .map(|corner| [0, 1, 2].map(|axis| (corner >> axis & 1) as f32))
            .collect();
        assert_eq!(order(&corners), [0, 1, 2, 3, 4, 5, 6, 7]);
        corners.reverse();
        assert_eq!(order(&corners), [7, 6, 5, 4, 3, 2, 1, 0]);
        // Of one place, in order; nobody is lost.
        assert_eq!(order(&[[2.0; 3]; 4]), [0, 1, 2, 3]);
        assert!(order(&[]).is_empty());
    }
}
