// The canvas: a photo in its colors, or nothing over the scene, with strokes, brush and marks.
import { css } from "./color.js";

const GROUND = 12;
/** Pixels of the screen for one of the photo. */
const ZOOM = [0.05, 40];
const WHEEL_STEP = 0.0015;
const MARK = "#f0962a";

const at = (id) => document.getElementById(id);

export const EASEL = `
<canvas id="easel" tabindex="0" aria-label="The photo. Drag to paint; press ? for the keys."></canvas>
<div id="paint-wipe" role="slider" tabindex="0" aria-label="Wipe" aria-valuemin="0" aria-valuemax="100" hidden><span></span></div>
<p id="over-left" class="label" hidden></p>`;

export class Easel {
  constructor(dragWipe) {
    this.canvas = at("easel");
    this.pen = this.canvas.getContext("2d");
    /** Pictures: `base`, what lies over its `left` part, and the `layer` of strokes. */
    this.shown = {};
    /** Width and height of the photo; null where the scene is behind. */
    this.size = null;
    this.view = { scale: 1, x: 0, y: 0 };
    this.wipe = 0.5;
    /** Strokes that are in no picture yet: points and color. */
    this.strokes = [];
    /** Places to be marked, in shares of the photo, with a number. */
    this.marks = [];
    /** Place and radius of the brush; null where there is none. */
    this.brush = null;
    this.waits = false;
    new ResizeObserver(() => this.fit()).observe(this.canvas);
    dragWipe(at("paint-wipe"), this.canvas, (share, event) => {
      const left = event ? this.place(event)[0] / this.size[0] : share;
      this.wipe = Math.min(1, Math.max(0, left));
      this.draw();
    });
  }

  /** Where an event is, in pixels of the photo or of the screen. */
  place({ clientX, clientY }) {
    const { scale, x, y } = this.view;
    return [(clientX - x) / scale, (clientY - y) / scale];
  }

  /** Brings the photo into the part of the page that nothing lies over. */
  fit() {
    if (this.size) {
      const [left, top, right, bottom] = this.room();
      const [width, height] = this.size;
      const scale = Math.min((right - left) / width, (bottom - top) / height);
      this.view = { scale, x: (left + right - scale * width) / 2, y: (top + bottom - scale * height) / 2 };
    } else {
      this.view = { scale: 1, x: 0, y: 0 };
    }
    this.draw();
  }

  room() {
    const parts = [this.canvas, at("brushes"), at("mixer"), at("strip"), at("paint-bar")];
    const [all, brushes, mixer, strip, bar] = parts.map((part) => part.getBoundingClientRect());
    const narrow = mixer.left < all.width / 2;
    const [left, top] = narrow ? [0, brushes.bottom] : [brushes.right, bar.bottom];
    const [right, bottom] = narrow ? [all.width, mixer.top] : [mixer.left, strip.top];
    return [left + GROUND, top + GROUND, Math.max(left + 60, right - GROUND), Math.max(top + 60, bottom - GROUND)];
  }

  zoom(event) {
    if (!this.size) return;
    event.preventDefault();
    const [x, y] = this.place(event);
    const lines = event.deltaMode === 1 ? 16 : 1;
    const scale = Math.min(ZOOM[1], Math.max(ZOOM[0], this.view.scale * Math.exp(-WHEEL_STEP * lines * event.deltaY)));
    this.view = { scale, x: event.clientX - x * scale, y: event.clientY - y * scale };
    this.draw();
  }

  shift(x, y) {
    this.view = { ...this.view, x, y };
    this.draw();
  }

  draw() {
    if (this.waits) return;
    this.waits = true;
    requestAnimationFrame(() => {
      this.waits = false;
      this.drawNow();
    });
  }

  drawNow() {
    const { canvas, pen, view } = this;
    const density = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.max(1, Math.round(side * density)));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.setTransform(density * view.scale, 0, 0, density * view.scale, density * view.x, density * view.y);
    if (this.size && this.shown.base) this.drawPhoto();
    for (const stroke of this.strokes) this.trace(stroke);
    for (const [[x, y], number] of this.size ? this.marks : []) this.mark(x * this.size[0], y * this.size[1], number);
    this.ring();
    this.placeWipe();
  }

  drawPhoto() {
    const { pen, shown, view } = this;
    const [w, h] = this.size;
    pen.imageSmoothingEnabled = view.scale < 3;
    pen.drawImage(shown.base, 0, 0, w, h);
    if (shown.left) {
      pen.save();
      pen.beginPath();
      pen.rect(0, 0, this.wipe * w, h);
      pen.clip();
      pen.drawImage(shown.left, 0, 0, w, h);
      pen.restore();
    }
    if (shown.layer) pen.drawImage(shown.layer, 0, 0, w, h);
  }

  trace({ points, color }) {
    const { pen } = this;
    pen.strokeStyle = color ? css(color) : "rgb(255 255 255 / 0.5)";
    pen.lineCap = "round";
    for (let k = 0; k < points.length; k++) {
      const [[x0, y0, r0], [x1, y1, r1]] = [points[Math.max(0, k - 1)], points[k]];
      pen.lineWidth = r0 + r1;
      pen.beginPath();
      pen.moveTo(x0, y0);
      pen.lineTo(x1 + 1e-3, y1);
      pen.stroke();
    }
  }

  /** A place to paint next: a circle with its number. */
  mark(x, y, number) {
    const { pen } = this;
    const one = 1 / this.view.scale;
    for (const [style, width] of [["#000", 4.5], [MARK, 2.5]]) {
      pen.strokeStyle = style;
      pen.lineWidth = width * one;
      pen.beginPath();
      pen.arc(x, y, 22 * one, 0, 7);
      pen.stroke();
    }
    pen.fillStyle = MARK;
    pen.beginPath();
    pen.arc(x + 16 * one, y - 16 * one, 9 * one, 0, 7);
    pen.fill();
    pen.fillStyle = "#000";
    pen.font = `600 ${12 * one}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillText(number, x + 16 * one, y - 16 * one);
  }

  /** The brush, where the pointer is. */
  ring() {
    if (!this.brush) return;
    const { pen } = this;
    const [x, y, radius] = this.brush;
    const one = 1.5 / this.view.scale;
    pen.lineWidth = one;
    for (const [style, more] of [["#000", 0], ["#fff", one]]) {
      pen.strokeStyle = style;
      pen.beginPath();
      pen.arc(x, y, radius + more, 0, 7);
      pen.stroke();
    }
  }

  placeWipe() {
    const handle = at("paint-wipe");
    const split = Boolean(this.size && this.shown.left);
    handle.hidden = at("over-left").hidden = !split;
    if (!split) return;
    const { scale, x, y } = this.view;
    const [width, height] = this.size;
    Object.assign(handle.style, { left: `${x + this.wipe * width * scale}px`, top: `${y}px`, height: `${height * scale}px` });
    Object.assign(at("over-left").style, { left: `${x + 8}px`, top: `${y + 8}px` });
    handle.setAttribute("aria-valuenow", Math.round(100 * this.wipe));
  }
}
