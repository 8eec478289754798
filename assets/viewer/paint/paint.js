// Painting: the program keeps the strokes and colors the scene, this draws them.
import { BRUSHES, Brush } from "./brush.js";
import { CHOICES, Choices } from "./choices.js";
import { EASEL, Easel } from "./easel.js";
import { MIXER, Mixer } from "./mixer.js";
import { pixelAt, pixelsOf } from "./pixels.js";
import { STRIP, Strip } from "./strip.js";
import { bitmap, colors, follow, knowsSecret, post, sent } from "./talk.js";

const BAR = `<nav id="paint-bar" aria-label="Paint">
  <span class="group" id="tabs"><button data-tab="photo" title="Photo or scene (V)">Photo</button><button data-tab="scene" title="Photo or scene (V)">Scene</button></span>
  <span class="group" id="versus" aria-label="Compare with">
    <button data-with="none">Result</button><button data-with="gray">Gray</button><button data-with="teacher">Teacher</button><button data-with="before">Before</button>
  </span>
  <button id="show-strokes" title="Show the strokes (S)">Strokes</button>
  <button id="doubt" title="Where nobody knows the colors: orange, and three places to paint next (D, N)">Doubt</button>
  <span class="group"><button id="undo" title="Undo (Ctrl-Z)">Undo</button><button id="redo" title="Redo (Ctrl-Shift-Z)">Redo</button></span>
  <button id="save" title="Color the run with the strokes (Ctrl-S)">Save</button>
  <button id="options" aria-expanded="false" title="What the run is colored with, and the command">Options</button>
</nav>`;

const KEYS = `<h2>Keys</h2><table>
<tr><th scope="row">drag</th><td>paint; Alt picks a color</td></tr>
<tr><th scope="row">wheel; Space and drag</th><td>zoom; move; 0 fits the photo</td></tr>
<tr><th scope="row">B K E P H</th><td>paint, keep the teacher, erase, pick, move</td></tr>
<tr><th scope="row">[ and ]</th><td>smaller, larger brush</td></tr>
<tr><th scope="row">← and →</th><td>previous and next photo</td></tr>
<tr><th scope="row">1 to 4</th><td>result, gray, teacher, before</td></tr>
<tr><th scope="row">S V</th><td>strokes, photo or scene</td></tr>
<tr><th scope="row">D N</th><td>doubt, next place to paint</td></tr>
<tr><th scope="row">Ctrl-Z, Ctrl-Shift-Z, Ctrl-S</th><td>undo, redo, save</td></tr></table>`;

const NAMES = { gray: "Gray", teacher: "Teacher", before: "Before" };
const NOTHING = { version: 0, colors: 0, undo: 0, redo: 0, painted: [], palette: [], saved: true, doubt: null, command: "", state: { phase: "opening", doing: "" } };

const at = (id) => document.getElementById(id);
const press = (id, on) => at(id).setAttribute("aria-pressed", String(on));
const pressOf = (id, key, value) => {
  for (const button of at(id).querySelectorAll("button")) button.setAttribute("aria-pressed", String(button.dataset[key] === value));
};

/** Puts the page into paint mode. `page` is what main.js lends. */
export async function paint(page) {
  const root = document.createElement("section");
  root.id = "paint";
  root.innerHTML = EASEL + BRUSHES + MIXER + STRIP + BAR + CHOICES;
  document.body.append(root);
  document.head.append(Object.assign(document.createElement("link"), { rel: "stylesheet", href: "paint/paint.css" }));
  document.body.classList.add("painting");
  await new Painting(page, root).begin();
}

class Painting {
  constructor(page, root) {
    Object.assign(this, { page, root });
    this.photos = page.about.paint.photos;
    this.sceneKeys = at("keys").innerHTML;
    this.news = NOTHING;
    this.photo = 0;
    this.tab = "photo";
    this.versus = "none";
    this.showsStrokes = false;
    this.doubts = false;
    this.note = "";
    /** Pictures of the photo: gray, result, layer, other, and pixels of those that colors are taken from. */
    this.pictures = {};
    this.easel = new Easel(page.dragWipe);
    this.mixer = new Mixer(() => this.brush.tool !== "brush" && this.brush.choose("brush"));
    this.brush = new Brush(this.easel, this.mixer, {
      drawn: (stroke) => this.send(stroke),
      picked: (place) => this.pick(place),
    });
    this.strip = new Strip(this.photos, (k) => this.load(k).catch(this.fail));
    this.choices = new Choices();
    this.refreshing = null;
    this.stale = false;
    this.fail = this.fail.bind(this);
  }

  async begin() {
    this.listen();
    pressOf("versus", "with", "none");
    this.showTab("photo");
    // For scripts.
    Object.assign(window.gsChroma, {
      easel: () => {
        const { scale, x, y } = this.easel.view;
        const [width, height] = this.size();
        return { x, y, width: scale * width, height: scale * height };
      },
      seen: () => this.page.fitted(),
      version: () => this.news.colors,
      doubt: () => this.news.doubt,
    });
    const first = this.photos.findIndex(({ camera }) => camera >= this.page.about.first);
    follow(this.news, (news, before) => this.hear(news, before));
    await this.load(Math.max(0, first));
  }

  fail(error) {
    this.note = error.message;
    this.showStatus();
    console.error(error);
  }

  size() {
    const { width, height } = this.photos[this.photo];
    return [width, height];
  }

  // ---- pictures

  async load(k) {
    const own = (k + this.photos.length) % this.photos.length;
    this.photo = own;
    this.strip.select(own);
    this.easel.strokes = [];
    const gray = await bitmap(`gray/${own}`);
    if (own !== this.photo) return;
    this.pictures = { gray };
    this.brush.levels = pixelsOf(gray);
    if (this.tab === "photo") this.easel.size = this.size();
    else this.page.jump(this.photos[own].camera);
    this.easel.fit();
    this.show();
    this.showStatus();
    await Promise.all([this.refresh(), this.compareWith(this.versus)]);
  }

  /** Brings result, layer and scene up to date; one at a time. */
  refresh() {
    this.stale = true;
    this.refreshing ??= this.refreshAll().catch(this.fail).finally(() => (this.refreshing = null));
    return this.refreshing;
  }

  async refreshAll() {
    while (this.stale) {
      this.stale = false;
      const [own, known, isLast] = [this.photo, [...this.easel.strokes], sent()];
      const tinted = this.doubts && this.news.doubt;
      if (this.tab === "scene") {
        await this.page.recolor(await colors(tinted), tinted);
      } else {
        const result = await bitmap(`${tinted ? "doubt" : "photo"}/${own}`);
        const layer = await bitmap(`layer/${own}`, false);
        if (own !== this.photo) continue;
        Object.assign(this.pictures, { result, layer, pixels: pixelsOf(result) });
      }
      // What was drawn before is in these pictures.
      if (isLast()) this.easel.strokes = this.easel.strokes.filter((stroke) => stroke === this.brush.stroke || !known.includes(stroke));
      this.show();
    }
  }

  async compareWith(what) {
    this.versus = what;
    pressOf("versus", "with", what);
    at("over-left").textContent = NAMES[what] ?? "";
    const { pictures } = this;
    pictures.other = null;
    if (what !== "none") {
      const other = what === "gray" ? pictures.gray : await bitmap(`${what}/${this.photo}`, false);
      if (pictures !== this.pictures || this.versus !== what) return;
      Object.assign(pictures, { other, otherPixels: other && pixelsOf(other) });
      if (!other) this.note = "no teacher has an answer for this photo";
    }
    this.showStatus();
    this.show();
  }

  /** Lays the pictures onto the canvas. */
  show() {
    const { gray, result, other, layer } = this.pictures;
    const strokes = this.showsStrokes || this.brush.tool === "eraser";
    this.easel.shown = { base: result ?? gray, left: other, layer: strokes ? layer : null };
    const places = this.doubts ? this.news.doubt ?? [] : [];
    const marks = places.map(([place, photo], k) => [place, k + 1, photo]);
    this.easel.marks = marks.filter(([, , photo]) => photo === this.photo);
    this.strip.show(this.news.painted, places);
    this.easel.draw();
  }

  // ---- strokes

  async send(stroke) {
    const { paint, points } = stroke;
    this.note = "";
    try {
      if (this.tab === "photo") {
        await post("stroke", { photo: this.photo, paint, points });
        return;
      }
      const { photos } = await post("view-stroke", { paint, points, camera: this.page.camera() });
      this.note = photos > 0 ? `on ${photos} photo${photos > 1 ? "s" : ""}` : "no photo shows this: nothing was painted";
      if (photos === 0) throw new Error(this.note);
      this.showStatus();
    } catch (error) {
      this.easel.strokes = this.easel.strokes.filter((other) => other !== stroke);
      this.easel.draw();
      this.fail(error);
    }
  }

  pick(place) {
    const { other, otherPixels, pixels } = this.pictures;
    const left = other && place[0] < this.easel.wipe * this.size()[0];
    const color = pixelAt(left ? otherPixels : pixels ?? this.brush.levels, place);
    if (color) this.mixer.take(color);
  }

  ask(what) {
    this.note = "";
    post(what).catch(this.fail);
  }

  // ---- what is said

  hear(news, before) {
    this.news = news;
    this.showStatus();
    this.mixer.showPalette(news.palette);
    this.choices.show(news);
    at("undo").disabled = news.undo === 0;
    at("redo").disabled = news.redo === 0;
    at("save").disabled = news.saved || news.state.phase === "saving";
    if (this.doubts && !news.doubt && news.state.phase !== "solving" && before.state.phase !== news.state.phase) this.ask("doubt");
    const changed = ["colors", "undo", "redo"].some((key) => before[key] !== news[key]);
    if (changed || Boolean(before.doubt) !== Boolean(news.doubt)) this.refresh();
    this.show();
  }

  showStatus() {
    const { news } = this;
    const { phase, doing, seconds, reason } = news.state;
    const said = {
      opening: () => `Opening${doing ? `: ${doing}` : ""}…`,
      ready: () => "Ready: draw a stroke of its color across a thing",
      previewed: () => "Previewed",
      solving: () => "Solving…",
      settled: () => `Settled in ${seconds.toFixed(1)} s`,
      saving: () => `Saving… ${doing}`,
      saved: () => "Saved",
      failed: () => reason,
      gone: () => "gs-chroma has ended; strokes are kept. Start it again, and open its new address",
    }[phase]();
    const facts = [said, this.tab === "photo" ? this.photos[this.photo].name : "the scene"];
    if (!news.saved && phase !== "saving") facts.push("not saved into the run");
    if (!knowsSecret) facts.push("open the whole address that the program printed, or nothing can be painted");
    if (this.note) facts.push(this.note);
    at("status").textContent = facts.join(" · ");
  }

  // ---- what is shown

  showTab(what) {
    this.tab = what;
    const scene = what === "scene";
    this.root.classList.toggle("scene", scene);
    pressOf("tabs", "tab", what);
    at("keys").innerHTML = scene ? `${KEYS}${this.sceneKeys}` : KEYS;
    this.easel.size = scene ? null : this.size();
    this.easel.strokes = [];
    this.brush.choose(scene ? "move" : "brush");
    if (scene) {
      // What lies under the brush has any lightness.
      this.mixer.look(60);
      this.page.jump(this.photos[this.photo].camera);
    }
    this.easel.fit();
    this.showStatus();
    if (this.pictures.gray) this.refresh();
  }

  toggleDoubt() {
    this.doubts = !this.doubts;
    press("doubt", this.doubts);
    if (this.doubts && !this.news.doubt) this.ask("doubt");
    this.show();
    this.refresh();
  }

  /** Goes to the next place that is in doubt. */
  nextPlace() {
    if (!this.doubts) return this.toggleDoubt();
    const photos = (this.news.doubt ?? []).map(([, photo]) => photo);
    if (photos.length > 0) this.load(photos[(photos.indexOf(this.photo) + 1) % photos.length]).catch(this.fail);
  }

  toggleStrokes() {
    this.showsStrokes = !this.showsStrokes;
    press("show-strokes", this.showsStrokes);
    this.show();
  }

  toggleOptions() {
    const hidden = !at("choices").hidden;
    at("choices").hidden = hidden;
    at("options").setAttribute("aria-expanded", String(!hidden));
  }

  // ---- keys

  /** What a key does; null for those of the scene. */
  act(key, held, shift) {
    const { brush } = this;
    const tool = (name) => () => {
      brush.choose(name);
      this.show();
    };
    if (held) return { z: () => this.ask(shift ? "redo" : "undo"), y: () => this.ask("redo"), s: () => at("save").click() }[key];
    const both = {
      v: () => this.showTab(this.tab === "scene" ? "photo" : "scene"), n: () => this.nextPlace(),
      b: tool("brush"), k: tool("keep"), h: tool("move"), " ": () => brush.hold(true),
      "[": () => brush.grow(1 / 1.15), "]": () => brush.grow(1.15),
    };
    if (this.tab === "scene") return both[key];
    const photo = {
      e: tool("eraser"), p: tool("dropper"), s: () => this.toggleStrokes(), d: () => this.toggleDoubt(), 0: () => this.easel.fit(),
      arrowleft: () => this.load(this.photo - 1).catch(this.fail), arrowright: () => this.load(this.photo + 1).catch(this.fail),
      // Of the scene.
      r: () => this.easel.fit(), i: () => {}, w: () => {}, a: () => {}, q: () => {}, arrowup: () => {}, arrowdown: () => {},
    };
    for (const [k, button] of [...at("versus").children].entries()) photo[k + 1] = () => button.click();
    return { ...both, ...photo }[key];
  }

  /** Keys come here first; those of the scene go on. */
  key(event) {
    const on = (selector) => event.target.closest?.(selector);
    if (on("input[type=text], input[type=number], select") || event.altKey) return;
    const does = this.act(event.key.toLowerCase(), event.ctrlKey || event.metaKey, event.shiftKey);
    if (!does || (on("button") && event.key === " ")) return;
    if (on("input, #paint-wipe") && event.key.startsWith("Arrow")) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    does();
  }

  listen() {
    window.addEventListener("keydown", (event) => this.key(event), { capture: true });
    window.addEventListener("keyup", (event) => event.key === " " && this.brush.hold(false), { capture: true });
    at("brushes").addEventListener("click", () => this.show());
    at("tabs").addEventListener("click", ({ target }) => target.dataset.tab && this.showTab(target.dataset.tab));
    at("versus").addEventListener("click", ({ target }) => target.dataset.with && this.compareWith(target.dataset.with).catch(this.fail));
    at("show-strokes").addEventListener("click", () => this.toggleStrokes());
    at("doubt").addEventListener("click", () => this.toggleDoubt());
    at("options").addEventListener("click", () => this.toggleOptions());
    for (const what of ["undo", "redo", "save"]) at(what).addEventListener("click", () => this.ask(what));
    for (const over of ["dragover", "drop"]) window.addEventListener(over, (event) => event.preventDefault());
    window.addEventListener("drop", ({ dataTransfer }) => dataTransfer.files[0] && this.mixer.refer(dataTransfer.files[0]).catch(this.fail));
  }
}
