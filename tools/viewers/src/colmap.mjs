// Cameras of a COLMAP folder: pinholes, text or binary, as everything here needs them.

import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';

// COLMAP's model ids that have no distortion, and how many focal lengths they have.
const PINHOLES = { SIMPLE_PINHOLE: 1, PINHOLE: 2 };
const MODEL_NAMES = ['SIMPLE_PINHOLE', 'PINHOLE'];

/**
 * The views of `folder/sparse/0` (or `sparse`, or the folder itself) by the name of their photo
 * without its extension: `{ width, height, fx, fy, cx, cy, rotation (3 rows), translation }`,
 * world to camera, x right, y down, z forward.
 */
export function readColmap(folder) {
  const model = ['sparse/0', 'sparse', '.'].map((at) => join(folder, at)).find((at) => existsSync(join(at, 'images.bin')) || existsSync(join(at, 'images.txt')));
  if (!model) throw new Error(`${folder}: no COLMAP model in it`);
  const binary = existsSync(join(model, 'images.bin'));
  const cameras = binary ? binaryCameras(join(model, 'cameras.bin')) : textCameras(join(model, 'cameras.txt'));
  const images = binary ? binaryImages(join(model, 'images.bin')) : textImages(join(model, 'images.txt'));
  const views = new Map();
  for (const { name, camera, quaternion, translation } of images) {
    const { model: kind, width, height, parameters } = cameras.get(camera);
    const focals = PINHOLES[kind];
    if (!focals) throw new Error(`${model}: camera model ${kind} is distorted; undistort the photos first`);
    const [fx, fy] = focals === 1 ? [parameters[0], parameters[0]] : parameters;
    const [cx, cy] = parameters.slice(focals);
    views.set(name.replace(/\.[^./]+$/, ''), { width, height, fx, fy, cx, cy, rotation: rotationOf(quaternion), translation });
  }
  return views;
}

/** A view as it looks in a picture of another size. */
export function resized(view, width, height) {
  const [x, y] = [width / view.width, height / view.height];
  return { ...view, width, height, fx: view.fx * x, fy: view.fy * y, cx: view.cx * x, cy: view.cy * y };
}

function rotationOf([w, x, y, z]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}

/** Reads little-endian numbers one after the other. */
class Cursor {
  constructor(path) {
    this.bytes = readFileSync(path);
    this.at = 0;
  }
  take(size, read) {
    const value = this.bytes[read](this.at);
    this.at += size;
    return value;
  }
  u32() { return this.take(4, 'readUInt32LE'); }
  u64() { return Number(this.take(8, 'readBigUInt64LE')); }
  f64() { return this.take(8, 'readDoubleLE'); }
  f64s(count) { return Array.from({ length: count }, () => this.f64()); }
  text() {
    const end = this.bytes.indexOf(0, this.at);
    const value = this.bytes.toString('utf8', this.at, end);
    this.at = end + 1;
    return value;
  }
}

function binaryCameras(path) {
  const cursor = new Cursor(path);
  const cameras = new Map();
  for (let left = cursor.u64(); left > 0; left -= 1) {
    const id = cursor.u32();
    const kind = cursor.u32();
    const model = MODEL_NAMES[kind];
    if (!model) throw new Error(`${path}: camera model ${kind} is distorted; undistort the photos first`);
    const [width, height] = [cursor.u64(), cursor.u64()];
    cameras.set(id, { model, width, height, parameters: cursor.f64s(PINHOLES[model] + 2) });
  }
  return cameras;
}

function binaryImages(path) {
  const cursor = new Cursor(path);
  return Array.from({ length: cursor.u64() }, () => {
    cursor.u32();
    const [quaternion, translation] = [cursor.f64s(4), cursor.f64s(3)];
    const [camera, name] = [cursor.u32(), cursor.text()];
    const points = cursor.u64();
    cursor.at += 24 * points;
    return { name, camera, quaternion, translation };
  });
}

function lines(path) {
  return readFileSync(path, 'utf8').split('\n').map((line) => line.trim()).filter((line) => !line.startsWith('#'));
}

function textCameras(path) {
  return new Map(lines(path).filter(Boolean).map((line) => {
    const [id, model, width, height, ...parameters] = line.split(/\s+/);
    return [Number(id), { model, width: Number(width), height: Number(height), parameters: parameters.map(Number) }];
  }));
}

function textImages(path) {
  // Every second line has the image's points, and may be empty.
  return lines(path).filter((line, index) => index % 2 === 0 && line).map((line) => {
    const [, qw, qx, qy, qz, tx, ty, tz, camera, ...name] = line.split(/\s+/);
    return { name: name.join(' '), camera: Number(camera), quaternion: [qw, qx, qy, qz].map(Number), translation: [tx, ty, tz].map(Number) };
  });
}
