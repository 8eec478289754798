//! Verdict on an evaluation, in words that follow from its figures.

use super::{ConsistencyScore, Evaluation, Method, PictureScore, psnr_in_words};

/// Ratios between these are no difference worth a word: other views would give as much.
const ALIKE: [f64; 2] = [0.9, 1.1];

/// Ratios between these are level with a method that colors the same Gaussians for the same views.
const LEVEL: [f64; 2] = [0.98, 1.02];

/// Ratios from which on something is so many times better.
const TIMES: f64 = 1.5;

/// Colorfulness below which it rounds to nothing.
const COLORLESS: f64 = 0.05;

/// ΔE00 below which a difference is invisible, and below which it is hard to see.
const UNSEEN: f64 = 1.0;
const FAINT: f64 = 2.0;

impl Evaluation {
    /// Verdict, a line each. docs/guide.md has the bounds.
    pub fn verdict(&self) -> Vec<String> {
        let others = self.compared().into_iter();
        let agreement = others.filter_map(|other| self.agreement(&other));
        let rest = [
            self.strength(),
            self.truth(),
            self.export(),
            Some(self.gray()),
        ];
        agreement.chain(rest.into_iter().flatten()).collect()
    }

    /// Agreement at equal colorfulness and a/b error, compared with another way to color.
    fn recipe(&self, other: &Method) -> Option<String> {
        let compared = |of: &dyn Fn(&Method) -> Option<f64>, what: &str| {
            let (ours, theirs) = (of(&Method::Exported)?, of(other)?);
            let ended = match ours / theirs {
                ratio if ratio < LEVEL[0] => "a win",
                ratio if ratio <= LEVEL[1] => "level",
                _ => "a loss",
            };
            Some(format!("{what} {ours:.2} against {theirs:.2}, {ended}"))
        };
        let differ = |method: &Method| self.consistency(method)?.equal_rms;
        let miss = |method: &Method| self.picture(method)?.ab_error;
        let agreement = compared(&differ, "views differ at equal colorfulness by")?;
        let error = compared(&miss, "; colors miss the photos' by").unwrap_or_default();
        Some(format!("beside {other}: {agreement}{error} (CIELAB units)"))
    }

    fn picture(&self, method: &Method) -> Option<&PictureScore> {
        self.pictures.iter().find(|score| score.method == *method)
    }

    /// Difference between photographed views of one place.
    fn consistency(&self, method: &Method) -> Option<&ConsistencyScore> {
        let mut scores = self.between.consistency.iter();
        scores.find(|score| score.method == *method)
    }

    /// Agreement between photographed views, or frames where a method has nothing else, compared
    /// with ours.
    fn agreement(&self, other: &Method) -> Option<String> {
        if self.peers.iter().any(|peer| peer.method == *other) {
            return self.recipe(other);
        }
        let name = match other {
            Method::Exported | Method::Native | Method::Photo => return None,
            Method::Teacher => "the teacher's own pictures",
            Method::PerFrame => "the teacher frame by frame",
            other => other.name(),
        };
        let colorful = |method: &Method| {
            let mut pictures = self.path.pictures.iter();
            Some(pictures.find(|score| score.method == *method)?.colorfulness)
        };
        // Gray frames agree without merit.
        if colorful(other).is_some_and(|strength| strength < COLORLESS) {
            return Some(format!("{name} has no colors"));
        }
        let views: Vec<&ConsistencyScore> = self.between.consistency.iter().collect();
        // Frames that are farthest apart come first.
        let path = self.path.consistency.iter().rev();
        let frames: Vec<&ConsistencyScore> = path.map(|one| &one.score).collect();
        let both = |scores: &[&ConsistencyScore]| {
            let rms = |method: &Method| {
                let mut own = scores.iter().filter(|score| score.method == *method);
                own.find_map(|score| score.rms)
            };
            Some([rms(&Method::Exported)?, rms(other)?])
        };
        let (what, [ours, theirs]) = match both(&views) {
            Some(figures) => ("views", figures),
            None => ("frames of the path", both(&frames)?),
        };
        let strength = match (colorful(&Method::Exported), colorful(other)) {
            (Some(ours), Some(theirs)) => format!("; colorfulness {ours:.1} against {theirs:.1}"),
            _ => String::new(),
        };
        let figures = format!("({ours:.2} against {theirs:.2} CIELAB units{strength})");
        // What rounds to nothing is nothing.
        let ratio = theirs.max(0.01) / ours.max(0.01);
        Some(format!("{what} agree {} {name} {figures}", times(ratio)))
    }

    /// Colorfulness over all photos, compared with the teacher's.
    fn strength(&self) -> Option<String> {
        let (ours, theirs) = (self.colorfulness?, self.teacher_colorfulness?);
        let ratio = ours / theirs;
        if !(ratio.is_finite() && theirs > 0.0) {
            return None;
        }
        let how = match () {
            () if ratio < ALIKE[0] => "weaker than",
            () if ratio > ALIKE[1] => "stronger than",
            () => "as strong as",
        };
        Some(format!(
            "colors are {how} the teacher's ({ratio:.2} of their colorfulness)"
        ))
    }

    /// Color error, ΔE00 to the photos, where these are in color.
    fn truth(&self) -> Option<String> {
        let of = |method| Some(self.picture(method)?.delta_e?.mean);
        let ours = of(&Method::Exported)?;
        let Some(theirs) = of(&Method::Teacher) else {
            return Some(format!("colors miss the photos' by ΔE00 {ours:.1}"));
        };
        let ratio = ours / theirs;
        let how = match () {
            () if ratio < ALIKE[0] => "nearer to the photos' than",
            () if ratio > ALIKE[1] => "farther from the photos' than",
            () => "as near to the photos' as",
        };
        Some(format!(
            "colors are {how} the teacher's (ΔE00 {ours:.1} against {theirs:.1})"
        ))
    }

    /// Color change by the export, in ΔE00.
    fn export(&self) -> Option<String> {
        let change = self.bake?.mean;
        let how = match () {
            () if change < UNSEEN => "which is invisible",
            () if change < FAINT => "which is hard to see",
            () => "which is visible",
        };
        Some(format!(
            "the exported file changes colors by ΔE00 {change:.1}, {how}"
        ))
    }

    /// Quality of the gray scene.
    fn gray(&self) -> String {
        let luma = &self.luma;
        let sharp = luma.sharpness / luma.photo_sharpness;
        let sharp = match sharp.is_finite() {
            true => format!(", {:.0} % of the photos' sharpness", 100.0 * sharp),
            false => String::new(),
        };
        let views = match &self.measured_on[..] {
            "test" => "held-out",
            _ => "training",
        };
        let kinds = [Some(luma.psnr), luma.corrected_psnr, luma.plain_psnr];
        format!("gray scene: {}{sharp}", psnr_in_words(views, kinds))
    }
}

/// A ratio in words; larger is better.
fn times(ratio: f64) -> String {
    let often = |ratio: f64| match ratio < 10.0 {
        true => format!("{ratio:.1} times"),
        false => format!("{ratio:.0} times"),
    };
    match () {
        () if ratio >= TIMES => format!("{} better than", often(ratio)),
        () if ratio > ALIKE[1] => "a little better than".to_owned(),
        () if ratio >= ALIKE[0] => "as well as".to_owned(),
        () if ratio > 1.0 / TIMES => "a little worse than".to_owned(),
        () => format!("{} worse than", often(1.0 / ratio)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_have_bounds() {
        for (ratio, words) in [
            (23.4, "23 times better than"),
            (7.04, "7.0 times better than"),
            (1.3, "a little better than"),
            (1.05, "as well as"),
            (0.8, "a little worse than"),
            (0.5, "2.0 times worse than"),
        ] {
            assert_eq!(times(ratio), words);
        }
    }
}
