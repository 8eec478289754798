// The scene as it travels: src/viewer/packed.rs writes it, this reads it.

const MAGIC = 0x56435347; // "GSCV"
const VERSION = 1;
const HEADER_BYTES = 32;

/** Arrays over the bytes of a packed scene; nothing is copied. */
export function unpack(bytes) {
  const head = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.byteLength < HEADER_BYTES || head.getUint32(0, true) !== MAGIC) {
    throw new Error("the scene is cut off or is none");
  }
  if (head.getUint32(4, true) !== VERSION) {
    throw new Error("the scene is of another version of gs-chroma: reload the page");
  }
  const count = head.getUint32(8, true);
  const degree = head.getUint32(12, true);
  const channels = head.getUint32(16, true);
  const coefficients = (degree + 1) ** 2;
  const means = bytes.byteOffset + HEADER_BYTES;
  const shapes = means + 12 * count;
  const colors = shapes + 16 * count;
  const halves = coefficients * channels * count;
  if (colors + 2 * halves > bytes.byteOffset + bytes.byteLength) {
    throw new Error("the scene is cut off");
  }
  return {
    count,
    degree,
    channels,
    coefficients,
    antialiased: head.getUint32(20, true) === 1,
    // Logarithms of scales are steps above the least.
    logScale: [head.getFloat32(24, true), head.getFloat32(28, true)],
    means: new Float32Array(bytes.buffer, means, 3 * count),
    shapes: new Uint32Array(bytes.buffer, shapes, 4 * count),
    colors: new Uint16Array(bytes.buffer, colors, halves),
  };
}

/** Bytes of base64, as scene.html carries them. */
export function fromBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text.trim());
  const binary = atob(text.trim());
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}
