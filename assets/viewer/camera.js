// Where the picture is taken from: a pose, a lens, and a pivot to turn around.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const less = (a, b) => add(a, times(b, -1));
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const unit = (a) => times(a, 1 / Math.max(Math.hypot(...a), 1e-12));

/** `v` turned by an angle about an axis of unit length (Rodrigues). */
function turned(v, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(times(v, c), times(cross(axis, v), s)), times(axis, dot(axis, v) * (1 - c)));
}

// How far up or down one may look, so that the picture stays the right side up.
const STEEPEST = 0.98;

export class Camera {
  constructor() {
    this.eye = [0, 0, -1];
    this.right = [1, 0, 0];
    this.down = [0, 1, 0];
    this.forward = [0, 0, 1];
    /** The world's up. COLMAP's y points down. */
    this.up = [0, -1, 0];
    /** Distance of what is turned around. */
    this.distance = 1;
    /** In pixels of a picture that is fitted into the canvas. */
    this.lens = { width: 4, height: 3, fx: 4, fy: 4, cx: 2, cy: 1.5 };
  }

  /** Takes the place of a photographed camera. */
  take(photographed, distance) {
    const [r, t] = [photographed.rotation, photographed.translation];
    [this.right, this.down, this.forward] = [r.slice(0, 3), r.slice(3, 6), r.slice(6, 9)];
    this.eye = times(add(add(times(this.right, t[0]), times(this.down, t[1])), times(this.forward, t[2])), -1);
    const { width, height, fx, fy, cx, cy } = photographed;
    this.lens = { width, height, fx, fy, cx, cy };
    this.distance = distance;
  }

  pivot() {
    return add(this.eye, times(this.forward, this.distance));
  }

  /** Turns what is around the pivot, by angles to the right and down. */
  orbit(right, down) {
    const pivot = this.pivot();
    this.turn(right, -down);
    this.eye = less(pivot, times(this.forward, this.distance));
  }

  /** Turns on the spot. */
  turn(right, up) {
    const steep = dot(this.forward, this.up);
    if ((up > 0 && steep > STEEPEST) || (up < 0 && steep < -STEEPEST)) up = 0;
    const about = (axis, angle) => {
      for (const side of ["right", "down", "forward"]) this[side] = unit(turned(this[side], axis, angle));
    };
    about(this.up, -right);
    about(this.right, up);
  }

  /** Moves along the picture's axes, in shares of the distance to the pivot. */
  move(right, down, forward) {
    const along = add(add(times(this.right, right), times(this.down, down)), times(this.forward, forward));
    this.eye = add(this.eye, times(along, this.distance));
  }

  /** Comes closer to the pivot by a factor. */
  dolly(factor) {
    const pivot = this.pivot();
    this.distance *= factor;
    this.eye = less(pivot, times(this.forward, this.distance));
  }

  /** Where the lens's picture lies in a canvas: left, top and scale. */
  fitted(width, height) {
    const { lens } = this;
    const scale = Math.min(width / lens.width, height / lens.height);
    return { scale, left: (width - scale * lens.width) / 2, top: (height - scale * lens.height) / 2 };
  }

  /** The view that a canvas shows. */
  view(width, height, near) {
    const { lens } = this;
    const { scale, left, top } = this.fitted(width, height);
    const size = { width, height, fx: scale * lens.fx, fy: scale * lens.fy, cx: scale * lens.cx + left, cy: scale * lens.cy + top };
    const rotation = [...this.right, ...this.down, ...this.forward];
    const translation = [this.right, this.down, this.forward].map((axis) => -dot(axis, this.eye));
    return { ...size, rotation, translation, eye: this.eye, near };
  }
}

/** The very view of a photographed camera. */
export function photographedView(camera, near) {
  const at = new Camera();
  at.take(camera, 1);
  return { ...at.view(camera.width, camera.height, near), rotation: camera.rotation, translation: camera.translation };
}

/** The mean of the cameras' ups; COLMAP's y where there is none. */
export function upOf(cameras) {
  const sum = cameras.reduce((sum, camera) => less(sum, camera.rotation.slice(3, 6)), [0, 0, 0]);
  return Math.hypot(...sum) > 0.1 * cameras.length && cameras.length > 0 ? unit(sum) : [0, -1, 0];
}

const SAMPLES = 20000;

/** The median depth of what a camera has in the middle of its picture. */
export function distanceOf(camera, means) {
  const [r, t] = [camera.rotation, camera.translation];
  const [count, depths] = [means.length / 3, []];
  const step = Math.max(1, Math.floor(count / SAMPLES));
  for (let i = 0; i < count; i += step) {
    const mean = [means[3 * i], means[3 * i + 1], means[3 * i + 2]];
    const [x, y, z] = [0, 3, 6].map((k, row) => dot(r.slice(k, k + 3), mean) + t[row]);
    if (z > 0 && Math.abs((camera.fx * x) / z) < camera.width / 4 && Math.abs((camera.fy * y) / z) < camera.height / 4) depths.push(z);
  }
  depths.sort((a, b) => a - b);
  return depths.length > 0 ? depths[depths.length >> 1] : 1;
}
