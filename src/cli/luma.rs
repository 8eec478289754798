//! Options that overlay the settings of stage 1.

use clap::Args;

use super::{
    headings::{BUDGET, EXPERT, QUALITY},
    values::{mebibytes, one_of, positive},
};
use crate::luma::{DensifyRules, FLAT, LumaOverlay, Numerics};

const RULES: &[(DensifyRules, &str)] = &[
    (DensifyRules::Own, "Splits alone, by absolute gradients"),
    (DensifyRules::Published, "As 3D Gaussian Splatting has it"),
];

/// Overrides of the preset's settings.
#[derive(Args)]
pub(super) struct LumaArguments {
    /// Number of iterations [default: the preset's].
    ///
    /// Turns early stopping off.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = BUDGET)]
    iterations: Option<u32>,
    /// Maximum number of Gaussians [default: the preset's].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = QUALITY)]
    max_splats: Option<u32>,
    /// Rules of densification [default: own].
    ///
    /// 3dgs: as published (Kerbl et al. 2023): splits and clones by signed gradients, opacity
    /// resets, removal of large Gaussians, an SH degree every 1,000 iterations, and its learning
    /// rates; without early stopping.
    #[arg(long, value_parser = one_of(RULES), hide_possible_values = true, value_name = "own|3dgs", help_heading = EXPERT)]
    densify: Option<DensifyRules>,
    /// Leave black what no photo shows, instead of surrounding the scene with a shell of gray.
    #[arg(long, help_heading = QUALITY, hide_short_help = true)]
    no_surround: bool,
    /// Start at COLMAP's points only, not also where photos match and it has none.
    #[arg(long, help_heading = QUALITY, hide_short_help = true)]
    no_fill_gaps: bool,
    /// Limit device memory, in MiB, by fewer Gaussians.
    #[arg(long, value_name = "MIB", value_parser = mebibytes(), help_heading = BUDGET)]
    memory_limit: Option<u64>,
    /// Stop early when twice the iterations would gain less, in dB.
    ///
    /// Training is rolled back to the best. 0.1 if no number follows [default: 0.3 with the preset
    /// balanced, 0.1 with paper, never with draft, --iterations or --time-limit]. With
    /// --target-psnr only if the target is out of reach.
    #[arg(long, value_name = "DB", num_args = 0..=1, require_equals = true, value_parser = positive::<f64>, help_heading = BUDGET, hide_short_help = true)]
    stop_when_flat: Option<Option<f64>>,
    /// Trade accuracy of training for time.
    ///
    /// Keys: alpha-min=0.00001..0.1, transmittance-min=0..0.5, depth-bits=32|24|16,
    /// storage=full|half, ssim-window=11|7|5, adam=exact|lazy. Measures, renders and files always
    /// compute as viewers do.
    #[arg(long, value_name = "KEY=VALUE[,…]", help_heading = EXPERT)]
    numerics: Option<Numerics>,
    /// Random seed: the same seed gives the same bytes on the same machine [default: 0].
    #[arg(long, value_name = "N", help_heading = EXPERT)]
    seed: Option<u64>,
}

impl LumaArguments {
    /// Changes to the preset's settings.
    pub(super) fn overlay(&self) -> LumaOverlay {
        LumaOverlay {
            iterations: self.iterations.map(|count| count as usize),
            stop_when_flat: match self.stop_when_flat {
                Some(gain) => Some(gain.unwrap_or(FLAT)),
                // Who says how many iterations wants them all.
                None => self.iterations.map(|_| 0.0),
            },
            rules: self.densify,
            max_splats: self.max_splats.map(|count| count as usize),
            surround: self.no_surround.then_some(false),
            fill_gaps: self.no_fill_gaps.then_some(false),
            memory_limit: self.memory_limit,
            numerics: self.numerics,
            seed: self.seed,
            ..LumaOverlay::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::luma::LumaSettings;
    use crate::luma::Preset;

    #[derive(Parser)]
    struct Only {
        #[command(flatten)]
        arguments: LumaArguments,
    }

    fn overlaid(preset: Preset, words: &[&str]) -> LumaSettings {
        let words = ["program"].iter().chain(words);
        let mut settings = preset.settings();
        let overlay = Only::parse_from(words).arguments.overlay();
        overlay.apply(&mut settings);
        settings
    }

    #[test]
    fn nothing_changes_nothing() {
        for preset in Preset::ALL {
            assert_eq!(overlaid(preset, &[]), preset.settings());
        }
    }

    #[test]
    fn whoever_says_how_many_iterations_wants_them_all() {
        let balanced = |words: &[&str]| overlaid(Preset::Balanced, words).stop_when_flat;
        assert_eq!(balanced(&[]), Some(0.3));
        assert_eq!(balanced(&["--iterations", "3500"]), None);
        let both = ["--iterations", "3500", "--stop-when-flat"];
        assert_eq!(balanced(&both), Some(FLAT));
        assert_eq!(balanced(&["--stop-when-flat=0.2"]), Some(0.2));
    }

    #[test]
    fn every_option_has_its_place() {
        let words = "--iterations 70 --max-splats 9 \
            --memory-limit 3 --numerics storage=half --seed 4";
        let words: Vec<&str> = words.split_whitespace().collect();
        let wanted = LumaSettings {
            iterations: 70,
            max_splats: 9,
            memory_limit: Some(3 << 20),
            numerics: "storage=half".parse().unwrap(),
            seed: 4,
            ..Preset::Draft.settings()
        };
        assert_eq!(overlaid(Preset::Draft, &words), wanted);
    }
}
