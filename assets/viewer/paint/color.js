// Colors: CIELAB, sRGB, and what a display shows.

const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
const encoded = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
const WHITE = [0.95047, 1, 1.08883];

/** sRGB from 0 to 1, unbounded, of CIELAB. */
export function labToRgb([l, a, b]) {
  const y = (l + 16) / 116;
  const [X, Y, Z] = [y + a / 500, y, y - b / 200].map((t, k) => WHITE[k] * (t > 6 / 29 ? t ** 3 : (t - 4 / 29) / 7.787037));
  return [
    3.2404542 * X - 1.5371385 * Y - 0.4985314 * Z,
    -0.969266 * X + 1.8760108 * Y + 0.041556 * Z,
    0.0556434 * X - 0.2040259 * Y + 1.0572252 * Z,
  ].map(encoded);
}

/** CIELAB of sRGB from 0 to 255. */
export function rgbToLab(rgb) {
  const [r, g, b] = rgb.map((v) => linear(v / 255));
  const xyz = [
    0.4124564 * r + 0.3575761 * g + 0.1804375 * b,
    0.2126729 * r + 0.7151522 * g + 0.072175 * b,
    0.0193339 * r + 0.119192 * g + 0.9503041 * b,
  ];
  const [x, y, z] = xyz.map((v, k) => v / WHITE[k]).map((t) => (t > 0.008856 ? Math.cbrt(t) : 7.787037 * t + 16 / 116));
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

export const shows = (rgb) => rgb.every((v) => v > -0.002 && v < 1.002);
export const bytes = (rgb) => rgb.map((v) => Math.round(255 * Math.min(1, Math.max(0, v))));

/** The color of a and b at a lightness as bytes, no more colorful than a display shows. */
export function colorAt(l, [a, b]) {
  let [low, high] = [0, 1];
  if (!shows(labToRgb([l, a, b]))) {
    for (let k = 0; k < 12; k++) {
      const mid = (low + high) / 2;
      if (shows(labToRgb([l, mid * a, mid * b]))) low = mid;
      else high = mid;
    }
    [a, b] = [low * a, low * b];
  }
  return bytes(labToRgb([l, a, b]));
}

/** a and b at a lightness over those at the middle one: the same surface under other light. */
export const shade = (l) => (Math.max(l, 10) + 16) / 66;

export const css = ([r, g, b]) => `rgb(${r} ${g} ${b})`;
