// The brush's color: a wheel of a and b, colors used before, and pictures to take colors from.
import { bytes, colorAt, css, labToRgb, rgbToLab, shade, shows } from "./color.js";
import { pixelAt, pixelsOf } from "./pixels.js";

/** The largest a and b of the wheel, in CIELAB units. */
const REACH = 100;
const WHEEL = 184;

const at = (id) => document.getElementById(id);

export const MIXER = `<div id="mixer">
  <canvas id="wheel" width="${WHEEL}" height="${WHEEL}" tabindex="0" role="img" aria-label="Colors at the lightness under the brush"></canvas>
  <p id="mixed"><span id="swatch"></span><span id="mixed-text"></span></p>
  <div id="palette" aria-label="Colors used"></div>
  <canvas id="reference" title="Click to take a color" hidden></canvas>
  <p id="drop">Drop a picture here to take colors from it.</p>
</div>`;

export class Mixer {
  /** `taken` is called when another color is taken. */
  constructor(taken) {
    this.taken = taken;
    /** a and b at the middle lightness. */
    this.paint = [30, 40];
    /** Lightness that the wheel shows: that under the brush, once it rests. */
    this.lightness = 60;
    this.waits = false;
    this.listen();
    this.draw();
  }

  /** a and b at the lightness of the wheel. */
  get ab() {
    return this.paint.map((v) => v * shade(this.lightness));
  }

  /** The color at the lightness of the wheel. */
  get color() {
    return this.at(this.lightness);
  }

  /** The color at a lightness. */
  at(lightness) {
    return colorAt(lightness, this.paint.map((v) => v * shade(lightness)));
  }

  /** Shows the wheel at another lightness. */
  look(lightness) {
    this.lightness = Math.min(92, Math.max(20, lightness));
    this.drawSoon();
  }

  /** Takes a color. */
  take(color) {
    const [l, a, b] = rgbToLab(color);
    this.paint = [a, b].map((v) => v / shade(l));
    this.drawSoon();
    this.taken();
  }

  drawSoon() {
    if (this.waits) return;
    this.waits = true;
    requestAnimationFrame(() => {
      this.waits = false;
      this.draw();
    });
  }

  draw() {
    const wheel = at("wheel").getContext("2d");
    const image = wheel.createImageData(WHEEL, WHEEL);
    const l = this.lightness;
    for (let k = 0; k < WHEEL * WHEEL; k++) {
      const [a, b] = [k % WHEEL, Math.floor(k / WHEEL)].map((v) => ((v + 0.5) / WHEEL - 0.5) * 2 * REACH);
      if (Math.hypot(a, b) > REACH) continue;
      const rgb = labToRgb([l, a, -b]);
      image.data.set([...bytes(rgb), shows(rgb) ? 255 : 60], 4 * k);
    }
    wheel.putImageData(image, 0, 0);
    const [a, b] = this.ab;
    const [x, y] = [a, -b].map((v) => (v / (2 * REACH) + 0.5) * WHEEL);
    for (const [style, r] of [["#000", 7], ["#fff", 5.5]]) {
      wheel.strokeStyle = style;
      wheel.lineWidth = 1.5;
      wheel.beginPath();
      wheel.arc(x, y, r, 0, 7);
      wheel.stroke();
    }
    at("swatch").style.background = css(this.color);
    at("mixed-text").textContent = `a ${Math.round(a)}  b ${Math.round(b)}  at L ${Math.round(l)}`;
  }

  turn(event) {
    const box = at("wheel").getBoundingClientRect();
    const [a, b] = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height].map((v) => (v - 0.5) * 2 * REACH);
    const far = Math.max(1, Math.hypot(a, b) / REACH);
    this.paint = [a / far, -b / far].map((v) => v / shade(this.lightness));
    this.drawSoon();
    this.taken();
  }

  /** Shows colors that were used. */
  showPalette(colors) {
    const palette = at("palette");
    const shown = JSON.stringify(colors);
    if (palette.dataset.colors === shown) return;
    palette.dataset.colors = shown;
    palette.replaceChildren(...colors.map((color) => {
      const button = Object.assign(document.createElement("button"), { title: css(color) });
      button.style.background = css(color);
      button.addEventListener("click", () => this.take(color));
      return button;
    }));
  }

  /** Shows a picture of the user's, which stays in the browser. */
  async refer(file) {
    const picture = await createImageBitmap(file);
    const canvas = at("reference");
    [canvas.width, canvas.height] = [WHEEL, Math.max(1, Math.round((WHEEL * picture.height) / picture.width))];
    canvas.getContext("2d").drawImage(picture, 0, 0, canvas.width, canvas.height);
    canvas.hidden = false;
    at("drop").hidden = true;
    this.reference = pixelsOf(canvas);
  }

  listen() {
    const wheel = at("wheel");
    wheel.addEventListener("pointerdown", (event) => {
      wheel.setPointerCapture(event.pointerId);
      this.turn(event);
    });
    wheel.addEventListener("pointermove", (event) => wheel.hasPointerCapture(event.pointerId) && this.turn(event));
    at("reference").addEventListener("click", (event) => {
      const { width, clientWidth } = at("reference");
      const color = pixelAt(this.reference, [event.offsetX, event.offsetY].map((v) => (v * width) / clientWidth));
      if (color) this.take(color);
    });
  }
}
