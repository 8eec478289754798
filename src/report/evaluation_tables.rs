//! The tables of `eval`, with a row a method in both.

use super::{
    ConsistencyScore, Evaluation, Method,
    table::{Table, figure},
};

/// The order of the rows: the file that viewers show comes first.
const ROWS: [Method; 10] = [
    Method::Exported,
    Method::Native,
    Method::Teacher,
    Method::RgbSplats,
    Method::ChromadistillPaper,
    Method::ChromadistillOneScale,
    Method::ChromadistillCode,
    Method::ChromadistillRgb,
    Method::PerFrame,
    Method::Photo,
];

impl Evaluation {
    /// Quality and consistency as tables.
    pub fn tables(&self) -> [Table; 2] {
        [self.quality_table(), self.consistency_table()].map(Table::without_empty_columns)
    }

    fn quality_table(&self) -> Table {
        let head = [
            "pictures",
            "PSNR",
            "corrected",
            "SSIM",
            "ΔE00",
            "95 %",
            "a/b error",
            "colorful",
            "colors",
            "gray PSNR",
            "sharp",
            "LPIPS",
        ];
        let none = || figure(None, 0);
        let luma = [
            "luma".to_owned(),
            format!("{:.2}", self.luma.psnr),
            figure(self.luma.corrected_psnr, 2),
            format!("{:.3}", self.luma.ssim),
            none(),
            none(),
            none(),
            none(),
            none(),
            format!("{:.2}", self.luma.psnr),
            format!("{:.0}", self.luma.sharpness),
            figure(self.luma.lpips, 3),
        ];
        let scores = ROWS.into_iter().flat_map(|method| {
            let all = self.pictures.iter();
            all.filter(move |score| score.method == method)
        });
        let colored = scores.map(|score| {
            [
                score.method.to_string(),
                figure(score.psnr, 2),
                none(),
                figure(score.ssim, 3),
                figure(score.delta_e.map(|e| e.mean), 2),
                figure(score.delta_e.map(|e| e.percentile_95), 2),
                figure(score.ab_error, 2),
                figure(Some(score.colorfulness), 1),
                figure(Some(score.diversity), 1),
                figure(Some(score.gray_psnr), 2),
                figure(Some(score.sharpness), 0),
                figure(score.lpips, 3),
            ]
        });
        let which = match &self.measured_on[..] {
            "test" => "held-out",
            _ => "training",
        };
        let mut notes = vec![
            "PSNR in dB; corrected: of luma after each photo's own gain and offset; a/b error: root mean square in CIELAB units, lightness taken from the photo."
                .to_owned(),
            "Colors: effective number of a/b squares five units wide; sharp: variance of the Laplacian of the gray picture, 0 to 255."
                .to_owned(),
        ];
        notes.extend(self.peers.iter().map(|peer| {
            format!(
                "{}: {} steps, {:.0} passes over a view, {:.1} s.",
                peer.method, peer.iterations, peer.passes, peer.seconds
            )
        }));
        notes.extend(self.bake.map(|bake| {
            format!(
                "{} against {}: ΔE00 {:.2}, 95 % {:.2}.",
                Method::Exported,
                Method::Native,
                bake.mean,
                bake.percentile_95
            )
        }));
        Table {
            title: match self.views.len() {
                1 => format!("One {which} view against its photo"),
                count => format!("{count} {which} views against their photos"),
            },
            head: head.map(str::to_owned).to_vec(),
            rows: (std::iter::once(luma).chain(colored))
                .map(Vec::from)
                .collect(),
            notes,
        }
    }

    fn consistency_table(&self) -> Table {
        let mut deltas: Vec<usize> = self.path.consistency.iter().map(|c| c.delta).collect();
        deltas.dedup();
        let mut columns: Vec<(String, Vec<ConsistencyScore>)> = (deltas.into_iter())
            .map(|delta| {
                let at = self.path.consistency.iter().filter(|c| c.delta == delta);
                (format!("path, Δ = {delta}"), at.map(|c| c.score).collect())
            })
            .collect();
        let between = self.between.consistency.clone();
        columns.push(("photographed views".to_owned(), between));
        let rms = |method: Method, scores: &[ConsistencyScore]| {
            let score = scores.iter().find(|score| score.method == method)?;
            Some((score.rms?, score.equal_rms))
        };
        let cell = |&found: &Option<(f64, Option<f64>)>| match found {
            Some((rms, Some(equal))) => format!("{rms:.2} ({equal:.2})"),
            found => figure(found.map(|(rms, _)| rms), 2),
        };
        let rows = ROWS.into_iter().filter_map(|method| {
            let figures: Vec<_> = (columns.iter())
                .map(|(_, scores)| rms(method, scores))
                .collect();
            let cells = figures.iter().map(cell);
            let row = std::iter::once(method.to_string()).chain(cells).collect();
            figures.iter().any(Option::is_some).then_some(row)
        });
        let rows: Vec<Vec<String>> = rows.collect();
        let compared: Vec<String> = (columns.iter())
            .filter_map(|(name, scores)| {
                let any = scores.first()?;
                let visible = 100.0 * any.visible;
                Some(format!("{name}: {} ({visible:.0} %)", any.pairs))
            })
            .collect();
        let mut notes = vec![
            "Root mean square in CIELAB units; in brackets at the teacher's colorfulness."
                .to_owned(),
            format!(
                "Pairs of pictures, and how much of them is visible in both: {}.",
                compared.join(", ")
            ),
            format!(
                "Path of {} frames, {} flow; photographed views are a pair where {:.0} % or more is visible.",
                self.path.frames,
                self.path.flow,
                100.0 * self.between.least_overlap
            ),
            format!("Pixels are {}.", self.rules.mask),
            format!(
                "eval.json has mean squares, too: {}; denominator: {}.",
                self.rules.scale, self.rules.denominator
            ),
        ];
        notes.extend(self.between.flow_error.map(|pixels| {
            format!(
                "Between photographed views the flow misses COLMAP's points by {pixels:.1} pixels (median)."
            )
        }));
        if !self.path.skipped.is_empty() {
            notes.push(format!(
                "The path is too short for Δ = {:?}.",
                self.path.skipped
            ));
        }
        let head = std::iter::once("pictures".to_owned());
        Table {
            title: "Differences of a, b between views of one place".to_owned(),
            head: head
                .chain(columns.into_iter().map(|(name, _)| name))
                .collect(),
            rows,
            notes,
        }
    }
}
