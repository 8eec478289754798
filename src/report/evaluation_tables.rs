//! The tables of `eval`, with a row a method.

use std::collections::BTreeSet;

use super::{
    ConsistencyScore, Evaluation, Method, PathConsistency,
    table::{Table, figure},
};

impl Evaluation {
    /// Quality, consistency and detections as tables.
    pub fn tables(&self) -> Vec<Table> {
        let mut tables = vec![self.quality_table(), self.consistency_table()];
        tables.extend(self.detection_table());
        tables
            .into_iter()
            .map(Table::without_empty_columns)
            .collect()
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
        let colored = self.pictures.iter().map(|score| {
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
            "PSNR in dB; corrected: exposure-corrected, after each photo's own gain and offset; a/b error: root mean square in CIELAB units, lightness taken from the photo."
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
        let mut columns: Vec<(String, Vec<ConsistencyScore>)> = Vec::new();
        for PathConsistency { delta, score } in &self.path.consistency {
            let name = format!("path, Δ = {delta}");
            match columns.last_mut().filter(|(last, _)| *last == name) {
                Some((_, scores)) => scores.push(score.clone()),
                None => columns.push((name, vec![score.clone()])),
            }
        }
        let between = self.between.consistency.clone();
        columns.push(("photographed views".to_owned(), between));
        let cell = |found: Option<&ConsistencyScore>| {
            let rms = found.and_then(|score| score.rms);
            match found.and_then(|score| score.equal_rms) {
                Some(equal) => format!("{} ({equal:.2})", figure(rms, 2)),
                None => figure(rms, 2),
            }
        };
        let rows = self.compared().into_iter().map(|method| {
            let rms = |(_, scores): &(String, Vec<ConsistencyScore>)| {
                cell(scores.iter().find(|score| score.method == method))
            };
            let frames = self.path.pictures.iter().find(|one| one.method == method);
            let mut row = vec![method.to_string()];
            row.extend(columns.iter().map(rms));
            row.push(figure(frames.map(|one| one.colorfulness), 1));
            row.push(figure(frames.map(|one| one.gray_psnr), 2));
            row.push(figure(frames.map(|one| one.sharpness), 0));
            row
        });
        let rows = rows.collect();
        let compared: Vec<String> = (columns.iter())
            .filter_map(|(name, scores)| {
                let any = scores.first()?;
                let visible = 100.0 * any.visible;
                Some(format!("{name}: {} ({visible:.0} %)", any.pairs))
            })
            .collect();
        let mut notes = vec![
            "Root mean square in CIELAB units, in brackets at the teacher's colorfulness; colorfulness, gray PSNR (against the gray frames in 8 bits) and sharpness are of the path's frames.".to_owned(),
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
        let mut head = vec!["pictures".to_owned()];
        head.extend(columns.into_iter().map(|(name, _)| name));
        head.extend(["colorful", "gray PSNR", "sharp"].map(str::to_owned));
        Table {
            title: "Differences of a, b between views of one place".to_owned(),
            head,
            rows,
            notes,
        }
    }

    /// Methods whose pictures were compared with each other.
    pub(super) fn compared(&self) -> Vec<Method> {
        let path = self.path.consistency.iter().map(|one| &one.score);
        let scores = path.chain(&self.between.consistency);
        let compared = scores.filter(|score| score.rms.is_some());
        let methods: BTreeSet<&Method> = compared.map(|score| &score.method).collect();
        methods.into_iter().cloned().collect()
    }

    fn detection_table(&self) -> Option<Table> {
        let rows = self.path.detections.iter().map(|score| {
            vec![
                score.method.to_string(),
                format!("{:.2}", score.per_frame),
                figure(score.score, 2),
                figure(score.kept, 2),
            ]
        });
        let head = ["pictures", "objects a frame", "score", "kept"];
        (!self.path.detections.is_empty()).then(|| Table {
            title: format!("Detected objects in {} frames of the path", self.path.frames),
            head: head.map(str::to_owned).to_vec(),
            rows: rows.collect(),
            notes: vec![
                "Detections with scores of 0.3 or more; kept: share with one of the same class in the next frame, intersection over union 0.5 or more, the motion between frames not taken out."
                    .to_owned(),
            ],
        })
    }
}
