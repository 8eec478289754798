// One camera and the sizes of what it looks at.
struct View {
    // Rows of the world-to-camera transform, translation in w.
    row0: vec4f,
    row1: vec4f,
    row2: vec4f,
    // Camera center in world space, near distance in w.
    center_near: vec4f,
    // fx, fy, cx, cy in pixels.
    intrinsics: vec4f,
    // Lowest x/z, y/z and highest x/z, y/z that the linearized projection uses.
    slope_limits: vec4f,
    size: vec2u,
    tiles: vec2u,
    splat_count: u32,
    // Degree of the spherical harmonics in use.
    sh_degree: u32,
    instance_capacity: u32,
    padding: u32,
}
