// The tools: what the pointer does on the canvas.
import { lightnessAt } from "./pixels.js";

const LARGEST = 100;
const RESTS = 250;

const at = (id) => document.getElementById(id);

export const BRUSHES = `<div id="brushes" role="toolbar" aria-label="Tools">
  <button data-tool="move" title="Shift the photo, turn the scene (H, or hold Space)">Move</button>
  <button data-tool="brush" title="Paint (B)">Paint</button>
  <button data-tool="keep" title="Keep the teacher's colors here (K)">Keep</button>
  <button data-tool="eraser" title="No claim here (E)">Erase</button>
  <button data-tool="dropper" title="Take a color from the picture (P, or hold Alt)">Pick</button>
  <label for="size">Size <output id="size-shown"></output></label>
  <input id="size" type="range" min="1" max="${LARGEST}" step="1" title="[ and ]">
  <label id="pen"><input id="pressure" type="checkbox" checked> pen pressure</label>
</div>`;

export class Brush {
  /** `drawn` is given every finished stroke, `picked` every place that a color is taken from. */
  constructor(easel, mixer, { drawn, picked }) {
    Object.assign(this, { easel, mixer, drawn, picked });
    this.tool = "brush";
    this.size = 24;
    /** Pixels of the photo without colors; none of the scene. */
    this.levels = null;
    this.stroke = null;
    this.drag = null;
    this.space = false;
    this.resting = null;
    this.listen();
    this.resize(this.size);
    this.choose("brush");
  }

  choose(tool) {
    this.tool = tool;
    for (const button of at("brushes").querySelectorAll("button")) button.setAttribute("aria-pressed", String(button.dataset.tool === tool));
    this.pass();
  }

  hold(space) {
    this.space = space;
    this.pass();
  }

  /** Lets the pointer through to the scene where it moves that. */
  pass() {
    const moves = this.tool === "move" || this.space;
    this.easel.canvas.style.pointerEvents = moves && !this.easel.size ? "none" : "";
    this.easel.canvas.style.cursor = moves ? "grab" : "none";
    this.easel.brush = null;
    this.easel.draw();
  }

  resize(to) {
    this.size = Math.min(LARGEST, Math.max(1, Math.round(to)));
    at("size").value = this.size;
    at("size-shown").textContent = `${this.size} px`;
    this.easel.draw();
  }

  grow(factor) {
    this.resize(factor > 1 ? Math.max(this.size + 1, this.size * factor) : Math.min(this.size - 1, this.size * factor));
  }

  radius(event) {
    const pressed = event.pointerType === "pen" && at("pressure").checked ? 0.25 + 0.75 * event.pressure : 1;
    return Math.max(0.5, (this.size / 2) * pressed);
  }

  picks(event) {
    return this.easel.size && (this.tool === "dropper" || event.altKey);
  }

  /** Shows the wheel at the lightness of a place of the photo. */
  look(place) {
    const found = this.easel.size && this.levels && lightnessAt(this.levels, place, Math.min(12, this.size / 2));
    if (found) this.mixer.look(found);
  }

  down(event) {
    const { easel } = this;
    easel.canvas.focus({ preventScroll: true });
    easel.canvas.setPointerCapture(event.pointerId);
    if (event.button === 1 || this.space || this.tool === "move") {
      this.drag = { x: event.clientX - easel.view.x, y: event.clientY - easel.view.y };
      return;
    }
    if (event.button !== 0 || this.stroke) return;
    const place = easel.place(event);
    if (this.picks(event)) return this.picked(place);
    this.look(place);
    const { color } = this.mixer;
    const paint = { eraser: "nothing", keep: "teacher" }[this.tool] ?? { color };
    this.stroke = { paint, color: paint.color, points: [[...place, this.radius(event)]] };
    easel.strokes.push(this.stroke);
    easel.draw();
  }

  move(event) {
    const { easel, stroke, drag } = this;
    const place = easel.place(event);
    if (drag) {
      easel.brush = null;
      if (easel.size) easel.shift(event.clientX - drag.x, event.clientY - drag.y);
      return;
    }
    easel.brush = [...place, this.picks(event) ? 5 / easel.view.scale : this.size / 2];
    if (stroke) {
      for (const one of event.getCoalescedEvents?.() ?? [event]) {
        const [x, y] = easel.place(one);
        const [x0, y0, r] = stroke.points[stroke.points.length - 1];
        if (Math.hypot(x - x0, y - y0) >= Math.max(0.5, r / 6)) stroke.points.push([x, y, this.radius(one)]);
      }
    } else {
      // Once the pointer rests there, and not on its way to the wheel.
      clearTimeout(this.resting);
      this.resting = setTimeout(() => this.look(place), RESTS);
    }
    easel.draw();
  }

  up() {
    this.drag = null;
    const { stroke } = this;
    this.stroke = null;
    if (!stroke) return;
    if (stroke.paint.color && this.easel.size && this.levels) stroke.paint = { color: this.mixer.at(this.light(stroke)) };
    this.drawn(stroke);
  }

  /** The mean lightness under a stroke: its color is that of the thing, not of the place where it begins. */
  light({ points }) {
    const some = points.filter((_, k) => k % Math.ceil(points.length / 100) === 0);
    const light = some.map(([x, y, r]) => lightnessAt(this.levels, [x, y], Math.min(12, r))).filter((l) => l !== null);
    return light.length > 0 ? light.reduce((sum, l) => sum + l, 0) / light.length : this.mixer.lightness;
  }

  leave() {
    clearTimeout(this.resting);
    this.easel.brush = null;
    this.easel.draw();
  }

  listen() {
    const { canvas } = this.easel;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => this.up());
    canvas.addEventListener("pointerleave", () => this.leave());
    canvas.addEventListener("wheel", (event) => this.easel.zoom(event), { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    at("size").addEventListener("input", () => this.resize(Number(at("size").value)));
    at("brushes").addEventListener("click", ({ target }) => target.dataset.tool && this.choose(target.dataset.tool));
  }
}
