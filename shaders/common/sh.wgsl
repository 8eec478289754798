// Real spherical harmonics with the constants and signs of 3DGS splat files.
const SH_C0: f32 = 0.28209479177387814;
const SH_C1: f32 = 0.4886025119029199;
const SH_C2: array<f32, 5> = array<f32, 5>(
    1.0925484305920792, -1.0925484305920792, 0.31539156525252005,
    -1.0925484305920792, 0.5462742152960396);
const SH_C3: array<f32, 7> = array<f32, 7>(
    -0.5900435899266435, 2.890611442640554, -0.4570457994644658, 0.3731763325901154,
    -0.4570457994644658, 1.445305721320277, -0.5900435899266435);

// Value of basis function `k` and its gradient with respect to the direction.
struct ShTerm {
    value: f32,
    slope: vec3f,
}

// `d` need not be of unit length for the slope to be that of the polynomial.
fn sh_term(k: u32, d: vec3f) -> ShTerm {
    let x = d.x;
    let y = d.y;
    let z = d.z;
    switch k {
        case 0u: { return ShTerm(SH_C0, vec3f(0.0)); }
        case 1u: { return ShTerm(-SH_C1 * y, vec3f(0.0, -SH_C1, 0.0)); }
        case 2u: { return ShTerm(SH_C1 * z, vec3f(0.0, 0.0, SH_C1)); }
        case 3u: { return ShTerm(-SH_C1 * x, vec3f(-SH_C1, 0.0, 0.0)); }
        case 4u: { return ShTerm(SH_C2[0] * x * y, SH_C2[0] * vec3f(y, x, 0.0)); }
        case 5u: { return ShTerm(SH_C2[1] * y * z, SH_C2[1] * vec3f(0.0, z, y)); }
        case 6u: { return ShTerm(SH_C2[2] * (2.0 * z * z - x * x - y * y), SH_C2[2] * vec3f(-2.0 * x, -2.0 * y, 4.0 * z)); }
        case 7u: { return ShTerm(SH_C2[3] * x * z, SH_C2[3] * vec3f(z, 0.0, x)); }
        case 8u: { return ShTerm(SH_C2[4] * (x * x - y * y), SH_C2[4] * vec3f(2.0 * x, -2.0 * y, 0.0)); }
        case 9u: { return ShTerm(SH_C3[0] * y * (3.0 * x * x - y * y), SH_C3[0] * vec3f(6.0 * x * y, 3.0 * (x * x - y * y), 0.0)); }
        case 10u: { return ShTerm(SH_C3[1] * x * y * z, SH_C3[1] * vec3f(y * z, x * z, x * y)); }
        case 11u: { return ShTerm(SH_C3[2] * y * (4.0 * z * z - x * x - y * y), SH_C3[2] * vec3f(-2.0 * x * y, 4.0 * z * z - x * x - 3.0 * y * y, 8.0 * y * z)); }
        case 12u: { return ShTerm(SH_C3[3] * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y), SH_C3[3] * vec3f(-6.0 * x * z, -6.0 * y * z, 6.0 * z * z - 3.0 * x * x - 3.0 * y * y)); }
        case 13u: { return ShTerm(SH_C3[4] * x * (4.0 * z * z - x * x - y * y), SH_C3[4] * vec3f(4.0 * z * z - 3.0 * x * x - y * y, -2.0 * x * y, 8.0 * x * z)); }
        case 14u: { return ShTerm(SH_C3[5] * z * (x * x - y * y), SH_C3[5] * vec3f(2.0 * x * z, -2.0 * y * z, x * x - y * y)); }
        default: { return ShTerm(SH_C3[6] * x * (x * x - 3.0 * y * y), SH_C3[6] * vec3f(3.0 * (x * x - y * y), -6.0 * x * y, 0.0)); }
    }
}
