// CIELAB of encoded sRGB (CIE 15:2004, white D65), and the adjoint of the way there.

// Linear R, G and B to X, Y and Z relative to white.
const TO_X: vec3f = vec3f(0.4339527553, 0.3762194147, 0.1898278300);
const TO_Y: vec3f = vec3f(0.212671, 0.715160, 0.072169);
const TO_Z: vec3f = vec3f(0.01775791409, 0.1094765209, 0.8727655650);

// Where the CIE function turns from a line to the cube root, (6/29)³, and the line's slope.
const CUBE_ROOT_FROM: f32 = 0.008856452;
const LINE_SLOPE: f32 = 7.787037;

// Where sRGB turns from a line to a power (IEC 61966-2-1).
const POWER_FROM: f32 = 0.04045;

struct Lab {
    value: vec3f,
    // Slopes of linear light by encoded values, and of the CIE function by relative X, Y, Z.
    by_encoded: vec3f,
    by_relative: vec3f,
}

fn lab_of(rgb: vec3f) -> Lab {
    let on_line = rgb <= vec3f(POWER_FROM);
    let base = (max(rgb, vec3f(POWER_FROM)) + 0.055) / 1.055;
    // base^0.4. Devices' powers are rough; a step of Newton's method makes up for it.
    var fifth = pow(base * base, vec3f(0.2));
    let fourth = fifth * fifth * fifth * fifth;
    fifth -= (fourth * fifth - base * base) / (5.0 * fourth);
    let linear = select(base * base * fifth, rgb / 12.92, on_line);
    let by_encoded = select(2.4 / 1.055 * base * fifth, vec3f(1.0 / 12.92), on_line);
    let relative = vec3f(dot(TO_X, linear), dot(TO_Y, linear), dot(TO_Z, linear));
    let is_dark = relative <= vec3f(CUBE_ROOT_FROM);
    let bright = max(relative, vec3f(CUBE_ROOT_FROM));
    var root = pow(bright, vec3f(1.0 / 3.0));
    root -= (root * root * root - bright) / (3.0 * root * root);
    let f = select(root, LINE_SLOPE * relative + 4.0 / 29.0, is_dark);
    let by_relative = select(1.0 / (3.0 * root * root), vec3f(LINE_SLOPE), is_dark);
    let value = vec3f(116.0 * f.y - 16.0, 500.0 * (f.x - f.y), 200.0 * (f.y - f.z));
    return Lab(value, by_encoded, by_relative);
}

// What a slope by L, a and b is by encoded R, G and B.
fn rgb_gradient(lab: Lab, slope: vec3f) -> vec3f {
    let by_f = vec3f(500.0 * slope.y, 116.0 * slope.x - 500.0 * slope.y + 200.0 * slope.z, -200.0 * slope.z);
    let s = by_f * lab.by_relative;
    return (s.x * TO_X + s.y * TO_Y + s.z * TO_Z) * lab.by_encoded;
}
