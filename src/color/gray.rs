//! Gray with the lightness of a color.

use super::lab::{LUMINANCE, luminance_to_lightness};
use super::srgb::{linear_to_srgb, srgb_to_linear};

/// The encoded gray with the same `L*` as an encoded sRGB color.
///
/// `L*` depends on relative luminance alone and rises with it, so equal `L*`
/// means equal luminance: the way over Lab reduces to encoding Y.
pub fn gray_from_rgb([r, g, b]: [f64; 3]) -> f64 {
    linear_to_srgb(
        LUMINANCE[0] * srgb_to_linear(r)
            + LUMINANCE[1] * srgb_to_linear(g)
            + LUMINANCE[2] * srgb_to_linear(b),
    )
}

/// `L*` in `[0, 100]` of an encoded gray in `[0, 1]`.
pub fn gray_to_lightness(gray: f64) -> f64 {
    luminance_to_lightness(srgb_to_linear(gray))
}

/// [`gray_from_rgb`] for 8-bit colors, by tables, rounded to the nearest
/// 8-bit gray.
pub struct GrayTable {
    /// Contribution of each 8-bit value of R, G and B to luminance, 0 to 1.
    luminance: [[f64; 256]; 3],
    /// The luminance halfway, in encoded values, between grays k and k + 1;
    /// the last is never reached.
    threshold: [f64; 256],
    /// The gray at the lower end of each of `CELLS` equal steps of luminance.
    cell: Vec<u8>,
}

/// The encoding rises by at most 12.92 · 255 = 3,295 grays per unit of
/// luminance, so that no more than one threshold falls within a cell.
const CELLS: usize = 4096;

impl GrayTable {
    /// Computes the tables.
    pub fn new() -> Self {
        let linear: [f64; 256] = std::array::from_fn(|k| srgb_to_linear(k as f64 / 255.0));
        let mut threshold: [f64; 256] =
            std::array::from_fn(|k| srgb_to_linear((k as f64 + 0.5) / 255.0));
        threshold[255] = f64::INFINITY;
        Self {
            luminance: LUMINANCE.map(|weight| linear.map(|value| weight * value)),
            threshold,
            // One cell more: luminance may reach 1 or a rounding error above.
            cell: (0..=CELLS)
                .map(|i| {
                    let y = i as f64 / CELLS as f64;
                    threshold.partition_point(|&t| t <= y) as u8
                })
                .collect(),
        }
    }

    /// The 8-bit gray with the `L*` of an 8-bit color. Grays map to themselves.
    pub fn gray(&self, [r, g, b]: [u8; 3]) -> u8 {
        let y = self.luminance[0][usize::from(r)]
            + self.luminance[1][usize::from(g)]
            + self.luminance[2][usize::from(b)];
        let gray = self.cell[((y * CELLS as f64) as usize).min(CELLS)];
        gray + u8::from(y >= self.threshold[usize::from(gray)])
    }
}

impl Default for GrayTable {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::super::srgb_to_lab;
    use super::*;

    #[test]
    fn gray_keeps_lightness() {
        for i in 0..11_i32.pow(3) {
            let rgb = [i % 11, i / 11 % 11, i / 121].map(|k| f64::from(k) / 10.0);
            let gray = gray_from_rgb(rgb);
            let want = srgb_to_lab(rgb)[0];
            assert!((srgb_to_lab([gray; 3])[0] - want).abs() < 1e-5, "{rgb:?}");
            assert!((gray_to_lightness(gray) - want).abs() < 1e-5, "{rgb:?}");
        }
    }

    #[test]
    fn middle_gray_has_its_lightness() {
        assert!((gray_to_lightness(0.5) - 53.388_96).abs() < 1e-4);
    }

    #[test]
    fn table_rounds_the_exact_answer() {
        let table = GrayTable::new();
        // Steps coprime to 256 reach every value of each channel.
        for i in 0..200_000_u32 {
            let rgb = [i.wrapping_mul(37) as u8, (i / 7) as u8, (i / 131) as u8];
            let exact = gray_from_rgb(rgb.map(|c| f64::from(c) / 255.0)) * 255.0;
            assert_eq!(table.gray(rgb), exact.round() as u8, "{rgb:?}: {exact}");
        }
    }

    #[test]
    fn table_leaves_grays_alone() {
        let table = GrayTable::new();
        for k in 0..=255 {
            assert_eq!(table.gray([k; 3]), k);
        }
    }

    #[test]
    fn no_cell_holds_two_thresholds() {
        let table = GrayTable::new();
        for pair in table.cell.windows(2) {
            assert!(pair[1] - pair[0] <= 1);
        }
    }
}
