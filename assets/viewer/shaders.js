// The kernels of shaders/project.wgsl, shade.wgsl and blend.wgsl for WebGL 2.

// Texels in a row of every texture that holds Gaussians.
export const ROW_BITS = 12;

// Quads in one instance: software draws instances one after the other, and so do some GPUs
// with those of four corners.
export const QUADS = 256;

const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
const int ROW_BITS = ${ROW_BITS};
// The smallest opacity that is blended.
const float ALPHA_MIN = 0.00392156862745098;
ivec2 texel(int i) { return ivec2(i & ((1 << ROW_BITS) - 1), i >> ROW_BITS); }
`;

export const COVER = `${HEAD}
void main() {
  vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}`;

// One fragment a Gaussian: center, covariance, opacity and color in the image.
export const PROJECT = `${HEAD}
// Variance in px² added to every projected covariance.
const float BLUR = 0.3;

uniform sampler2D means;
uniform usampler2D shapes;
uniform sampler2D colors;
uniform int count;
uniform int degree;
uniform bool gray;
uniform bool antialiased;
uniform vec2 log_scale;
uniform mat3 world_to_camera;
uniform vec3 translation;
uniform vec3 eye;
uniform vec4 intrinsics;
uniform vec4 slope_limits;
uniform vec2 size;
uniform float near;

layout(location = 0) out uvec4 footprint;
layout(location = 1) out uvec4 shown;

mat3 rotation(vec4 q) {
  float w = q.x, x = q.y, y = q.z, z = q.w;
  return mat3(
    1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
    2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
    2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}

vec3 sh(int i, int k) { return texelFetch(colors, texel(i * (degree + 1) * (degree + 1) + k), 0).rgb; }

// Spherical harmonics with the constants and signs of splat files.
vec3 shade(int i, vec3 d) {
  float x = d.x, y = d.y, z = d.z;
  vec3 sum = 0.28209479177387814 * sh(i, 0);
  if (degree > 0) {
    sum += 0.4886025119029199 * (z * sh(i, 2) - y * sh(i, 1) - x * sh(i, 3));
  }
  if (degree > 1) {
    sum += 1.0925484305920792 * (x * y * sh(i, 4) - y * z * sh(i, 5) - z * x * sh(i, 7))
      + 0.31539156525252005 * (2.0 * z * z - x * x - y * y) * sh(i, 6)
      + 0.5462742152960396 * (x * x - y * y) * sh(i, 8);
  }
  if (degree > 2) {
    sum += -0.5900435899266435 * (y * (3.0 * x * x - y * y) * sh(i, 9) + x * (x * x - 3.0 * y * y) * sh(i, 15))
      + 2.890611442640554 * x * y * z * sh(i, 10)
      - 0.4570457994644658 * (4.0 * z * z - x * x - y * y) * (y * sh(i, 11) + x * sh(i, 13))
      + 0.3731763325901154 * z * (2.0 * z * z - 3.0 * x * x - 3.0 * y * y) * sh(i, 12)
      + 1.445305721320277 * z * (x * x - y * y) * sh(i, 14);
  }
  return max((gray ? sum.rrr : sum) + 0.5, 0.0);
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  int i = (at.y << ROW_BITS) + at.x;
  footprint = uvec4(0u);
  shown = uvec4(0u);
  if (i >= count) return;
  vec3 mean = texelFetch(means, at, 0).xyz;
  vec3 camera = world_to_camera * mean + translation;
  if (!(camera.z > near)) return;
  uvec4 shape = texelFetch(shapes, at, 0);
  vec2 z_opacity = vec2(shape.y & 0xffffu, shape.y >> 16);
  vec3 scale = exp(log_scale.x + log_scale.y * vec3(shape.x & 0xffffu, shape.x >> 16, z_opacity.x));
  vec4 quat = normalize(vec4(unpackSnorm2x16(shape.z), unpackSnorm2x16(shape.w)));
  float opacity = z_opacity.y / 65535.0;

  mat3 turned = rotation(quat);
  mat3 axes = world_to_camera * mat3(turned[0] * scale.x, turned[1] * scale.y, turned[2] * scale.z);
  vec2 slope = clamp(camera.xy / camera.z, slope_limits.xy, slope_limits.zw);
  vec2 focal = intrinsics.xy / camera.z;
  vec3 row2 = vec3(axes[0].z, axes[1].z, axes[2].z);
  vec3 row_x = focal.x * (vec3(axes[0].x, axes[1].x, axes[2].x) - slope.x * row2);
  vec3 row_y = focal.y * (vec3(axes[0].y, axes[1].y, axes[2].y) - slope.y * row2);
  vec3 covariance = vec3(dot(row_x, row_x) + BLUR, dot(row_x, row_y), dot(row_y, row_y) + BLUR);
  // Without cancellation: the Gram determinant is the squared length of the cross product.
  vec3 normal = cross(row_x, row_y);
  float determinant = dot(normal, normal) + BLUR * (covariance.x + covariance.z - BLUR);
  if (!(determinant > 0.0 && determinant < 1e38)) return;
  if (antialiased) opacity *= length(normal) / sqrt(determinant);
  if (!(opacity >= ALPHA_MIN)) return;

  vec2 center = intrinsics.xy * camera.xy / camera.z + intrinsics.zw;
  vec2 extent = sqrt(2.0 * log(opacity / ALPHA_MIN) * covariance.xz);
  if (!(all(greaterThan(center + extent, vec2(0.0))) && all(lessThan(center - extent, size)))) return;
  vec3 color = shade(i, normalize(mean - eye));
  footprint = floatBitsToUint(vec4(center, covariance.xy));
  shown = uvec4(floatBitsToUint(covariance.z), floatBitsToUint(determinant),
    packHalf2x16(vec2(opacity, color.r)), packHalf2x16(color.gb));
}`;

// From back to front, the rectangle around each Gaussian's ellipse.
export const QUAD = `${HEAD}
uniform usampler2D order;
uniform int ordered;
uniform usampler2D footprints;
uniform usampler2D shown;
uniform vec2 size;
uniform int drawn;

flat out vec2 center;
flat out vec3 conic;
flat out vec4 color;

void main() {
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  int place_in_order = gl_InstanceID * ${QUADS} + (gl_VertexID >> 2);
  if (place_in_order >= ordered) return;
  ivec2 at = texel(int(texelFetch(order, texel(place_in_order), 0).x));
  uvec4 rest = texelFetch(shown, at, 0);
  vec2 opacity_red = unpackHalf2x16(rest.z);
  if (opacity_red.x <= 0.0) return;
  vec4 place = uintBitsToFloat(texelFetch(footprints, at, 0));
  center = place.xy;
  float xx = place.z, xy = place.w, yy = uintBitsToFloat(rest.x), determinant = uintBitsToFloat(rest.y);
  conic = vec3(yy, -xy, xx) / determinant;
  color = vec4(opacity_red.y, unpackHalf2x16(rest.w), opacity_red.x);
  float half_difference = 0.5 * (xx - yy);
  float longest = 0.5 * (xx + yy) + length(vec2(half_difference, xy));
  vec2 along = abs(xy) < 1e-6 * longest
    ? (xx >= yy ? vec2(1.0, 0.0) : vec2(0.0, 1.0))
    : normalize(half_difference >= 0.0 ? vec2(longest - yy, xy) : vec2(xy, longest - xx));
  // Up to where alpha is one 8-bit step, and half a pixel beyond.
  float reach = drawn == 0 ? sqrt(2.0 * max(log(255.0 * color.a), 0.0)) : 2.0;
  vec2 halves = reach * sqrt(vec2(longest, determinant / longest)) + 0.5;
  if (drawn == 1) halves = vec2(2.0);
  vec2 corner = vec2((gl_VertexID & 1) * 2 - 1, (gl_VertexID & 2) - 1);
  vec2 pixel = center + along * (corner.x * halves.x) + vec2(-along.y, along.x) * (corner.y * halves.y);
  gl_Position = vec4(2.0 * pixel.x / size.x - 1.0, 1.0 - 2.0 * pixel.y / size.y, 0.0, 1.0);
}`;

// Premultiplied, to be laid over what is behind.
export const BLEND = `${HEAD}
const float ALPHA_MAX = 0.99;
uniform vec2 size;
// 0 the scene, 1 centers, 2 ellipsoids of two standard deviations.
uniform int drawn;
flat in vec2 center;
flat in vec3 conic;
flat in vec4 color;
out vec4 pixel;

void main() {
  vec2 d = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y) - center;
  float power = 0.5 * (conic.x * d.x * d.x + conic.z * d.y * d.y) + conic.y * d.x * d.y;
  float alpha = min(ALPHA_MAX, color.a * exp(-power));
  if (drawn == 1) {
    if (dot(d, d) > 2.25) discard;
    alpha = 0.9;
  } else if (drawn == 2) {
    if (!(power >= 0.0 && power <= 2.0)) discard;
    alpha = power > 1.6 ? 0.9 : 0.15 * color.a;
  } else if (!(power >= 0.0 && alpha >= ALPHA_MIN)) {
    discard;
  }
  pixel = vec4(color.rgb * alpha, alpha);
}`;

// The picture on the screen, scaled where it was drawn smaller.
export const SHOW = `${HEAD}
uniform sampler2D picture;
uniform vec2 scale;
out vec4 pixel;
void main() { pixel = vec4(clamp(texture(picture, gl_FragCoord.xy * scale).rgb, 0.0, 1.0), 1.0); }`;
