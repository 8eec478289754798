// PNGs and their distance.

import { readFileSync } from 'node:fs';
import { PNG } from 'pngjs';

/** `{ width, height, data }`, RGBA. */
export function readPng(path) {
  return PNG.sync.read(readFileSync(path));
}

export function decodePng(bytes) {
  return PNG.sync.read(bytes);
}

/** Peak signal-to-noise ratio over R, G and B, in dB. */
export function psnr(a, b) {
  if (a.width !== b.width || a.height !== b.height) throw new Error(`pictures of ${a.width}×${a.height} and ${b.width}×${b.height}`);
  let sum = 0;
  for (let i = 0; i < a.data.length; i += 4) {
    for (let c = 0; c < 3; c += 1) sum += (a.data[i + c] - b.data[i + c]) ** 2;
  }
  return 10 * Math.log10(255 ** 2 / (sum / (a.width * a.height * 3)));
}

/** The mean of R, G and B, 0 to 1: where it differs, a viewer is too dark or too bright. */
export function brightness({ data, width, height }) {
  let sum = 0;
  for (let i = 0; i < data.length; i += 4) sum += data[i] + data[i + 1] + data[i + 2];
  return sum / (255 * 3 * width * height);
}

export function median(values) {
  const sorted = [...values].sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}
