// Rotation matrix of a unit quaternion (w x y z in q.x q.y q.z q.w).
fn rotation_from_quat(q: vec4f) -> mat3x3f {
    let w = q.x;
    let x = q.y;
    let y = q.z;
    let z = q.w;
    // Columns.
    return mat3x3f(
        vec3f(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
        vec3f(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
        vec3f(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
    );
}

// Gradient of a loss with respect to the unit quaternion, given the gradient
// with respect to the rotation matrix (columns).
fn quat_gradient(q: vec4f, g: mat3x3f) -> vec4f {
    let w = q.x;
    let x = q.y;
    let y = q.z;
    let z = q.w;
    return 2.0 * vec4f(
        x * (g[1].z - g[2].y) + y * (g[2].x - g[0].z) + z * (g[0].y - g[1].x),
        -2.0 * x * (g[1].y + g[2].z) + y * (g[0].y + g[1].x) + z * (g[0].z + g[2].x) + w * (g[1].z - g[2].y),
        x * (g[0].y + g[1].x) - 2.0 * y * (g[0].x + g[2].z) + z * (g[1].z + g[2].y) + w * (g[2].x - g[0].z),
        x * (g[0].z + g[2].x) + y * (g[1].z + g[2].y) - 2.0 * z * (g[0].x + g[1].y) + w * (g[0].y - g[1].x),
    );
}
