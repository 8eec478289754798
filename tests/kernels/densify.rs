//! `densify`: kept and dropped moments.

use gs_chroma::{
    gpu::Buffer,
    luma::densify::{DensifyKernels, Descent, Target},
};

use crate::{
    harness::{bits, gpu},
    oracle::random::Random,
};

const OLD: usize = 300;

/// Survivors with gaps, halves; 600 rows are three workgroups.
fn plan(random: &mut Random) -> Vec<Descent> {
    (0..600)
        .map(|j| Descent {
            source: (j * 7 % OLD) as u32,
            survives: u32::from(j % 3 == 0),
            offset: random.array::<3>(-2.0, 2.0).map(|v| v as f32),
            log_growth: random.array::<3>(-1.0, 0.5).map(|v| v as f32),
            logit_step: random.range(-2.0, 2.0) as f32,
            ..Descent::default()
        })
        .collect()
}

fn applied(plan: &[Descent], source: &[f32], target: Target) -> Vec<f32> {
    let plan = Buffer::from_slice(gpu(), "plan", plan).unwrap();
    let source = Buffer::from_slice(gpu(), "source", source).unwrap();
    let kernels = DensifyKernels::new(gpu());
    let new = kernels.apply(gpu(), &plan, OLD, &source, target).unwrap();
    new.read(gpu()).unwrap()
}

#[test]
fn fields_are_copied_and_newcomers_have_no_moments() {
    let mut random = Random::new(2);
    let plan = plan(&mut random);
    for planes in [1, 4, 16] {
        let old: Vec<f32> = (0..planes * OLD)
            .map(|_| random.range(-1.0, 1.0) as f32)
            .collect();
        let expected = |keeps: fn(&Descent) -> bool| -> Vec<f32> {
            (0..planes)
                .flat_map(|plane| plan.iter().map(move |descent| (plane, descent)))
                .map(|(plane, descent)| match keeps(descent) {
                    true => old[plane * OLD + descent.source as usize],
                    false => 0.0,
                })
                .collect()
        };
        let field = applied(&plan, &old, Target::Field);
        assert_eq!(bits(&field), bits(&expected(|_| true)), "{planes} planes");
        let moments = applied(&plan, &old, Target::Moments);
        let kept = expected(|descent| descent.survives == 1);
        assert_eq!(bits(&moments), bits(&kept), "{planes} planes");
    }
}
