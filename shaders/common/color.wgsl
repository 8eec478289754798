// What a Gaussian shows: one channel of luma, two of chroma, or RGB. Kernels
// are compiled once for each. What the adjoint brings back of a/b or RGB on frozen
// geometry has four figures: the gradient, then the curvature.
@if(luma) const CHANNELS: u32 = 1u;
@if(chroma) const CHANNELS: u32 = 2u;
@if(rgb) const CHANNELS: u32 = 3u;
@if(figures) const CHANNELS: u32 = 4u;

@if(luma) alias Color = f32;
@if(chroma) alias Color = vec2f;
@if(rgb) alias Color = vec3f;
@if(figures) alias Color = vec4f;

@if(luma) fn color_dot(a: Color, b: Color) -> f32 { return a * b; }
@if(chroma) fn color_dot(a: Color, b: Color) -> f32 { return dot(a, b); }
@if(rgb) fn color_dot(a: Color, b: Color) -> f32 { return dot(a, b); }

// Luma and RGB are stored around mid-gray and cannot be negative, as in splat
// files; chroma is stored as it is.
@if(luma) fn color_from_sh(sum: Color) -> Color { return max(sum + 0.5, 0.0); }
@if(chroma) fn color_from_sh(sum: Color) -> Color { return sum; }
@if(rgb) fn color_from_sh(sum: Color) -> Color { return max(sum + 0.5, vec3f(0.0)); }

// The adjoint of color_from_sh at a color that it returned. RGB that is black may
// still become brighter.
@if(luma) fn color_gradient(color: Color, gradient: Color) -> Color { return select(0.0, gradient, color > 0.0); }
@if(chroma) fn color_gradient(color: Color, gradient: Color) -> Color { return gradient; }
@if(rgb) fn color_gradient(color: Color, gradient: Color) -> Color { return select(vec3f(0.0), gradient, (color > vec3f(0.0)) | (gradient < vec3f(0.0))); }
