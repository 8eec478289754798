// How one view's teacher is brought into line with the others: wanted a/b become
// gain · ab + offset.
struct Correction {
    // Rows of the gain: aa, ab, ba, bb.
    gain: vec4f,
    offset: vec2f,
    padding: vec2f,
}

fn corrected(correction: Correction, ab: vec2f) -> vec2f {
    return vec2f(dot(correction.gain.xy, ab), dot(correction.gain.zw, ab)) + correction.offset;
}
