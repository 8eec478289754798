//! Points and sweeps for tests.

use super::sweep::{Outcome, PointStage, Setting, Subject, SweepPoint, TRADEOFF_VERSION, Tradeoff};

pub(super) fn sweep(points: Vec<SweepPoint>) -> Tradeoff {
    Tradeoff {
        version: TRADEOFF_VERSION,
        program: "0.1.0".to_owned(),
        subject: Subject {
            scene: "/photos/<garden>".to_owned(),
            teacher: None,
            options: vec!["--channel".to_owned(), "r".to_owned()],
        },
        device: None,
        budget: Some(60.0),
        points,
    }
}

pub(super) fn failed(name: &str, reason: &str) -> SweepPoint {
    SweepPoint {
        name: name.to_owned(),
        stage: PointStage::Luma,
        settings: Vec::new(),
        after: None,
        picture: None,
        commands: Vec::new(),
        took: 1.0,
        failed: Some(reason.to_owned()),
        outcome: None,
    }
}

pub(super) fn luma(name: &str, seconds: f64, psnr: f64) -> SweepPoint {
    let setting = |(knob, value): (&str, &str)| Setting {
        knob: knob.to_owned(),
        value: value.to_owned(),
    };
    SweepPoint {
        settings: name.rsplit_once('-').map(setting).into_iter().collect(),
        took: seconds,
        failed: None,
        outcome: Some(Outcome {
            iterations: 700,
            splats: 1000,
            seconds,
            psnr: Some(psnr),
            ssim: Some(psnr / 30.0),
            ..Outcome::default()
        }),
        ..failed(name, "")
    }
}
