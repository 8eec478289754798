//! A lint of the compiled shaders over naga's IR.
//!
//! No kernel may test for NaN by comparing floats with `!=`: compilers may
//! assume that there is no NaN. Every division, root, logarithm, power and
//! normalization of floats stands in [`REASONS`] with what keeps it finite.

mod reasons;

use std::collections::BTreeSet;

use gs_chroma::gpu::shaders;
use naga::{
    BinaryOperator, Expression, Function, MathFunction, Module, ScalarKind,
    valid::{Capabilities, FunctionInfo, ValidationFlags, Validator},
};
use reasons::REASONS;

/// Findings of the lint in one function.
#[derive(Default)]
struct Findings {
    /// `!=` between floats.
    comparisons: Vec<String>,
    /// Operations that need a reason.
    risky: Vec<String>,
}

fn is_float(module: &Module, info: &FunctionInfo, expression: naga::Handle<Expression>) -> bool {
    let inner = info[expression].ty.inner_with(&module.types);
    inner.scalar_kind() == Some(ScalarKind::Float)
}

fn lint(module: &Module, function: &Function, info: &FunctionInfo, source: &str) -> Findings {
    let mut findings = Findings::default();
    for (handle, expression) in function.expressions.iter() {
        let text = || {
            let text = &source[function
                .expressions
                .get_span(handle)
                .to_range()
                .unwrap_or(0..0)];
            text.split_whitespace().collect::<Vec<_>>().join(" ")
        };
        match *expression {
            Expression::Binary { op, left, .. } if is_float(module, info, left) => match op {
                BinaryOperator::NotEqual => findings.comparisons.push(text()),
                BinaryOperator::Divide | BinaryOperator::Modulo => findings.risky.push(text()),
                _ => {}
            },
            Expression::Math {
                fun:
                    MathFunction::Normalize
                    | MathFunction::Sqrt
                    | MathFunction::InverseSqrt
                    | MathFunction::Log
                    | MathFunction::Log2
                    | MathFunction::Pow
                    | MathFunction::Inverse
                    | MathFunction::Acos
                    | MathFunction::Asin,
                ..
            } => findings.risky.push(text()),
            _ => {}
        }
    }
    findings
}

/// All findings of a source as `(function, expression)`, comparisons first.
fn findings(name: &str, source: &str) -> [BTreeSet<(String, String)>; 2] {
    let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{name}: {e}"));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    let info = validator
        .validate(&module)
        .unwrap_or_else(|e| panic!("{name}: {e:?}"));
    let mut found = [BTreeSet::new(), BTreeSet::new()];
    let mut add = |function: &Function, info: &FunctionInfo, name: &str| {
        let Findings { comparisons, risky } = lint(&module, function, info, source);
        for (set, list) in found.iter_mut().zip([comparisons, risky]) {
            set.extend(list.into_iter().map(|text| (name.to_owned(), text)));
        }
    };
    for (handle, function) in module.functions.iter() {
        add(
            function,
            &info[handle],
            function.name.as_deref().unwrap_or_default(),
        );
    }
    for (index, entry) in module.entry_points.iter().enumerate() {
        add(&entry.function, info.get_entry_point(index), &entry.name);
    }
    found
}

#[test]
fn no_kernel_compares_floats_with_not_equal() {
    for (name, source) in shaders::ALL {
        assert_eq!(findings(name, source)[0], BTreeSet::new(), "{name}");
    }
}

#[test]
fn every_operation_that_can_leave_the_numbers_has_a_reason() {
    let found: BTreeSet<_> = (shaders::ALL.iter())
        .flat_map(|(name, source)| findings(name, source)[1].clone())
        .collect();
    let reasons: BTreeSet<_> = (REASONS.iter())
        .map(|(function, text, _)| ((*function).to_owned(), (*text).to_owned()))
        .collect();
    let without: Vec<_> = found.difference(&reasons).collect();
    assert!(without.is_empty(), "no reason for {without:#?}");
    let stale: Vec<_> = reasons.difference(&found).collect();
    assert!(stale.is_empty(), "a reason for nothing: {stale:#?}");
    assert!(REASONS.iter().all(|(_, _, reason)| reason.len() > 10));
}

/// An effect that is off leaves nothing in the kernels; one that is on is there.
#[test]
fn only_antialiased_kernels_know_of_the_compensation() {
    let traces = ["compensation", "v_log_opacity"];
    for (name, source) in shaders::ALL {
        let found = traces.iter().any(|trace| source.contains(trace));
        assert_eq!(found, name.contains("mip"), "{name}");
    }
}

/// So with the way another viewer draws.
#[test]
fn only_playcanvas_kernels_end_a_gaussian_early() {
    let traces = ["falloff", "0.075", "PARTIAL_OPACITY"];
    for (name, source) in shaders::ALL {
        let found = traces.iter().any(|trace| source.contains(trace));
        assert_eq!(found, name.contains("playcanvas"), "{name}");
    }
}

/// So with what training may trade for time.
#[test]
fn kernels_know_of_no_numerics_but_their_own() {
    for (trace, variant) in [
        ("upper_half", "blend_backward_luma_half"),
        ("unpacked", "sum_instances_luma_half"),
        ("RADIUS: u32 = 3u", "_window7"),
        ("RADIUS: u32 = 2u", "_window5"),
    ] {
        for (name, source) in shaders::ALL {
            assert_eq!(source.contains(trace), name.contains(variant), "{name}");
        }
    }
    // Lazy steps store nothing for what the view does not show; the others do so twice.
    for (name, source) in shaders::ALL {
        if name.contains("_step") {
            let stills = source.matches("ranks[i] == INVISIBLE").count();
            assert_eq!(stills, 1, "{name}");
            let at_once = source.contains("INVISIBLE {\n            return;");
            assert_eq!(at_once, name.ends_with("_lazy"), "{name}");
        }
    }
}

#[test]
fn the_lint_sees_what_it_is_for() {
    let source = "fn bad(x: f32, v: vec3f) -> f32 {
        if x != x { return 0.0; }
        return sqrt(x) / normalize(v).x + log(x) + f32(3u / 2u);
    }
    @compute @workgroup_size(1) fn main() { _ = bad(1.0, vec3f(1.0)); }";
    let [comparisons, risky] = findings("bad", source);
    assert_eq!(comparisons.len(), 1);
    let texts: Vec<_> = risky.iter().map(|(_, text)| text.as_str()).collect();
    assert_eq!(
        texts,
        ["log", "normalize", "sqrt", "sqrt(x) / normalize(v).x"]
    );
}
