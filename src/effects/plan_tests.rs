//! Plans from evidence, trials and overrides.

use glam::DVec3;

use super::*;
use crate::{
    capture::Observation,
    effects::fixtures::{capture, evidence, looking_along_z, photo},
};

fn plan(sh_degree: u32, overrules: &Overrules) -> Plan {
    let photos: Vec<_> = (0..3)
        .map(|k| {
            let camera = looking_along_z(DVec3::new(0.1 * f64::from(k), 0.0, -3.0), 32);
            (photo(&camera, |x, y| (x * 5 + y * 2) as u8), camera)
        })
        .collect();
    let points = (0..100).map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10), 0.0) * 0.1);
    let capture = capture(&photos, points);
    let room = TrainingBudget {
        sh_degree,
        iterations: 700,
    };
    evidence(&capture, &photos).decide(room, overrules, &Trials::new())
}

fn decided(plan: &Plan, effect: Effect) -> &Decision {
    let mut decisions = plan.decisions.iter();
    decisions
        .find(|decision| decision.effect == effect)
        .unwrap()
}

#[test]
fn every_effect_of_stage_1_is_decided_once() {
    let plan = plan(3, &Overrules::default());
    let order: Vec<Effect> = plan.decisions.iter().map(|d| d.effect).collect();
    assert_eq!(order, Effect::ALL);
}

#[test]
fn the_user_has_the_last_word() {
    let overrules = Overrules {
        with: vec![Effect::Exposure, Effect::LumaDegree],
        without: vec![Effect::Background],
        sh_degree: None,
    };
    let plan = plan(0, &overrules);
    for (effect, on) in [
        (Effect::Exposure, true),
        (Effect::LumaDegree, true),
        (Effect::Background, false),
    ] {
        let decision = decided(&plan, effect);
        assert_eq!((decision.on, decision.decided_by), (on, Decider::User));
    }
    // Draft has room for none, but one was asked for.
    assert_eq!(plan.sh_degree, 1);
    assert_eq!(overrules.choice(Effect::Robust), Choice::Auto);
}

#[test]
fn without_tracks_the_preset_decides_the_degree() {
    for room in [0, 2] {
        let plan = plan(room, &Overrules::default());
        let decision = decided(&plan, Effect::LumaDegree);
        assert_eq!(decision.evidence, None);
        assert_eq!(decision.decided_by, Decider::Preset);
        assert_eq!((plan.sh_degree, decision.on), (room, room > 0));
    }
    let asked = Overrules {
        sh_degree: Some(3),
        ..Overrules::default()
    };
    assert_eq!(plan(0, &asked).sh_degree, 3);
}

#[test]
fn a_trial_decides_where_the_evidence_is_in_doubt() {
    let exposure = |evidence| Decision::new(Effect::Exposure, Some(evidence), 2.0);
    let needs = |decision| {
        let plan = Plan {
            decisions: vec![decision],
            exposures: Vec::new(),
            sh_degree: 0,
        };
        !plan.in_doubt().is_empty()
    };
    assert!(needs(exposure(5.0)));
    assert!(!needs(exposure(1.9)) && !needs(exposure(8.1)));
    let behind = |evidence| Decision::new(Effect::Background, Some(evidence), 1.0);
    assert!(needs(behind(1.5)) && !needs(behind(20.0)));
    // Never sure to pay in viewers that do not antialias.
    assert!(needs(Decision::new(Effect::Antialias, Some(50.0), 2.0)));
    // Of these a trial cannot tell.
    for effect in [Effect::Robust, Effect::LumaDegree] {
        let decision = Decision::new(effect, Some(1.01), 1.0);
        assert!(decision.on && !needs(decision), "{effect:?}");
    }
    let asked = Overrules {
        with: vec![Effect::Exposure],
        ..Overrules::default()
    };
    assert!(!needs(exposure(5.0).overruled(&asked)));
    let tried = |gain| Trials::from([(Effect::Exposure, gain)]);
    for (gain, on) in [
        (0.31, true),
        (0.29, false),
        (-2.0, false),
        (f64::NAN, false),
    ] {
        let decision = exposure(5.0).after(&tried(gain));
        assert_eq!((decision.on, decision.decided_by), (on, Decider::Trial));
        assert!(!needs(decision));
    }
    assert!((behind(1.5).after(&Trials::from([(Effect::Background, 0.11)]))).on);
    let of_another = Trials::from([(Effect::Background, 0.3)]);
    assert_eq!(exposure(5.0).after(&of_another), exposure(5.0));
}

#[test]
fn what_a_trial_rejects_is_not_simulated() {
    let camera = looking_along_z(DVec3::new(0.0, 0.0, -3.0), 32);
    let photos: Vec<_> = (0..4)
        .map(|k| {
            (
                photo(&camera, |x, y| (40 + k * 4 + x * 2 + y) as u8),
                camera.clone(),
            )
        })
        .collect();
    let mut capture = capture(
        &photos,
        (0..100).map(|i| DVec3::new(f64::from(i % 10) - 4.5, f64::from(i / 10) - 4.5, 0.0) * 0.1),
    );
    for point in &mut capture.points {
        point.track = (0..4)
            .map(|view| Observation {
                view,
                pixel: [point.position.x, point.position.y].map(|x| 32.0 * x / 3.0 + 16.0),
            })
            .collect();
    }
    let room = TrainingBudget {
        sh_degree: 0,
        iterations: 700,
    };
    let mut evidence = evidence(&capture, &photos);
    let local = Exposure {
        gain: 1.5,
        offset: -0.25,
    };
    evidence.exposures.local.fill(local);
    evidence.exposures.drifts = false;
    let sure = evidence.decide(room, &Overrules::default(), &Trials::new());
    assert!(sure.has(Effect::Exposure) && evidence.open(&sure).is_empty());
    evidence.exposures.drifts = true;
    let plan = |trials: &[(Effect, f64)]| {
        evidence.decide(
            room,
            &Overrules::default(),
            &trials.iter().copied().collect(),
        )
    };
    let asked = plan(&[]);
    assert_eq!(evidence.open(&asked), [Effect::Exposure], "{asked}");
    assert_eq!(asked.exposures, [local; 4]);
    // As if the user had said so.
    let overrules = Overrules {
        without: vec![Effect::Exposure],
        ..Overrules::default()
    };
    let said = evidence.decide(room, &overrules, &Trials::new());
    let without = asked.clone().without(Effect::Exposure);
    assert!(!without.has(Effect::Exposure));
    assert_eq!(without.exposures, said.exposures);
    assert_eq!(without.sh_degree, said.sh_degree);
    assert_eq!(plan(&[(Effect::Exposure, 0.5)]).exposures, asked.exposures);
    let rejected = plan(&[(Effect::Exposure, 0.05)]);
    assert!(!rejected.has(Effect::Exposure));
    assert_eq!(rejected.exposures, [Exposure::NONE; 4]);
}

#[test]
fn evidence_decides_by_its_threshold() {
    let on = |evidence| Decision::new(Effect::Exposure, evidence, 2.0).on;
    assert!(on(Some(2.1)) && !on(Some(2.0)) && !on(None) && !on(Some(f64::NAN)));
}
