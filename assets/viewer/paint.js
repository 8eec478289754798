// Painting on the photos: the program keeps the strokes and colors the scene, this draws them.

const secret = location.hash.slice(1);

/** The largest a and b of the wheel, in CIELAB units. */
const REACH = 100;
const WHEEL = 184;
/** Pixels of the screen between which zooming stays. */
const ZOOM = [0.05, 40];
const WHEEL_STEP = 0.0015;
const AGAIN = 2000;
const RESTS = 250;

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

const shows = (rgb) => rgb.every((v) => v > -0.002 && v < 1.002);
const bytes = (rgb) => rgb.map((v) => Math.round(255 * Math.min(1, Math.max(0, v))));

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
const shade = (l) => (Math.max(l, 10) + 16) / 66;

const css = ([r, g, b]) => `rgb(${r} ${g} ${b})`;

const PAGE = `
<canvas id="easel" tabindex="0" aria-label="The photo. Drag to paint; press ? for the keys."></canvas>
<div id="paint-wipe" role="slider" tabindex="0" aria-label="Wipe" aria-valuemin="0" aria-valuemax="100" hidden><span></span></div>
<p id="over-left" class="label" hidden></p>
<div id="brushes" role="toolbar" aria-label="Tools">
  <button data-tool="brush" title="Paint (B)">Paint</button>
  <button data-tool="eraser" title="No claim here (E)">Erase</button>
  <button data-tool="dropper" title="Take a color from the picture (P, or hold Alt)">Pick</button>
  <label for="size">Size <output id="size-shown"></output></label>
  <input id="size" type="range" min="1" max="100" step="1" title="[ and ]">
  <label id="pen"><input id="pressure" type="checkbox" checked> pen pressure</label>
</div>
<div id="mixer">
  <canvas id="wheel" width="${WHEEL}" height="${WHEEL}" tabindex="0" role="img" aria-label="Colors at the lightness under the brush"></canvas>
  <p id="mixed"><span id="swatch"></span><span id="mixed-text"></span></p>
  <div id="palette" aria-label="Colors used"></div>
</div>
<div id="strip" role="listbox" aria-label="Photos"></div>
<nav id="paint-bar" aria-label="Paint">
  <span class="group" id="tabs"><button data-tab="photo" title="Photo or scene (V)">Photo</button><button data-tab="scene" title="Photo or scene (V)">Scene</button></span>
  <span class="group" id="versus" aria-label="Compare with">
    <button data-with="none">Result</button><button data-with="gray">Gray</button><button data-with="teacher">Teacher</button><button data-with="before">Before</button>
  </span>
  <button id="show-strokes" title="Show the strokes (S)">Strokes</button>
  <button id="doubt" title="Where nobody knows the colors: orange (D)">Doubt</button>
  <span class="group"><button id="undo" title="Undo (Ctrl-Z)">Undo</button><button id="redo" title="Redo (Ctrl-Shift-Z)">Redo</button></span>
  <button id="save" title="Color the run with the strokes (Ctrl-S)">Save</button>
  <button id="copy">Copy command</button>
</nav>`;

const KEYS = `<h2>Keys</h2><table>
<tr><th scope="row">drag</th><td>paint; Alt picks a color</td></tr>
<tr><th scope="row">wheel; Space and drag</th><td>zoom; shift the photo; 0 fits it</td></tr>
<tr><th scope="row">B E P</th><td>paint, erase, pick</td></tr>
<tr><th scope="row">[ and ]</th><td>smaller, larger brush</td></tr>
<tr><th scope="row">← and →</th><td>previous and next photo</td></tr>
<tr><th scope="row">1 to 4</th><td>result, gray, teacher, before</td></tr>
<tr><th scope="row">S D V</th><td>strokes, doubt, photo or scene</td></tr>
<tr><th scope="row">Ctrl-Z, Ctrl-Shift-Z, Ctrl-S</th><td>undo, redo, save</td></tr></table>`;

/** Puts the page into paint mode. `page` is what main.js lends. */
export async function paint(page) {
  const { about, jump, recolor, dragWipe } = page;
  const at = (id) => document.getElementById(id);
  const { photos } = about.paint;
  const root = document.createElement("section");
  root.id = "paint";
  root.innerHTML = PAGE;
  document.body.append(root);
  document.head.append(Object.assign(document.createElement("link"), { rel: "stylesheet", href: "paint.css" }));
  document.body.classList.add("painting");
  const sceneKeys = at("keys").innerHTML;

  const easel = at("easel");
  const pen = easel.getContext("2d");
  let news = { version: 0, colors: 0, undo: 0, redo: 0, painted: [], palette: [], saved: true, doubt: null, state: { phase: "opening", doing: "" } };
  let photo = 0;
  let tab = "photo";
  let tool = "brush";
  let versus = "none";
  let wipe = 0.5;
  let size = 24;
  /** The color of the brush: a and b at the middle lightness. */
  let paintOf = [30, 40];
  /** Lightness that the wheel shows: that under the brush, once it rests. */
  let lightness = 60;
  let resting = null;
  let showsStrokes = false;
  let doubts = false;
  /** Pictures of the photo: result, gray, layer and what is compared with. */
  let shown = {};
  let view = { scale: 1, x: 0, y: 0 };
  /** The stroke that is being drawn, and those that are on their way. */
  let stroke = null;
  let pending = [];
  let pointer = null;
  let space = false;
  let drag = null;
  let posts = Promise.resolve();
  let note = "";

  const fail = (error) => {
    note = error.message;
    showStatus();
    console.error(error);
  };

  async function bitmap(place, needed = true) {
    const answer = await fetch(`paint/${place}`, { cache: "no-store" });
    if (answer.status === 404 && !needed) return null;
    if (!answer.ok) throw new Error(await answer.text());
    return createImageBitmap(await answer.blob(), { colorSpaceConversion: "none", premultiplyAlpha: "default" });
  }

  /** Pixels of a picture, to be looked up. */
  function pixelsOf(image) {
    const held = new OffscreenCanvas(image.width, image.height);
    const context = held.getContext("2d", { willReadFrequently: true });
    context.drawImage(image, 0, 0);
    return context.getImageData(0, 0, image.width, image.height);
  }
  const pixel = ({ data, width, height }, [x, y]) => {
    const [i, j] = [Math.floor(x), Math.floor(y)];
    if (i < 0 || j < 0 || i >= width || j >= height) return null;
    return [...data.subarray(4 * (j * width + i), 4 * (j * width + i) + 3)];
  };

  /** Asks for something to be done; one after the other. */
  function post(what, body) {
    posts = posts.then(async () => {
      const answer = await fetch(`paint/${what}`, { method: "POST", headers: { "X-Secret": secret }, body: JSON.stringify(body ?? {}) });
      if (!answer.ok) throw new Error(await answer.text());
    });
    const done = posts;
    posts = posts.catch(fail);
    return done;
  }

  // ---- the photo

  async function load(k) {
    photo = (k + photos.length) % photos.length;
    for (const [i, item] of [...at("strip").children].entries()) {
      item.setAttribute("aria-selected", String(i === photo));
      if (i === photo) item.scrollIntoView({ block: "nearest", inline: "nearest" });
    }
    const own = photo;
    stroke = null;
    pending = [];
    const gray = await bitmap(`gray/${own}`);
    if (own !== photo) return;
    shown = { gray, levels: pixelsOf(gray) };
    fit();
    showStatus();
    await Promise.all([refresh(), compareWith(versus)]);
  }

  /** Brings result, layer and scene up to date; one at a time. */
  let refreshing = null;
  let stale = false;
  function refresh() {
    stale = true;
    refreshing ??= (async () => {
      while (stale) {
        stale = false;
        const [own, sent] = [photo, pending.length];
        const after = posts;
        const result = await bitmap(doubts && news.doubt ? `doubt/${own}` : `photo/${own}`);
        const layer = await bitmap(`layer/${own}`, false);
        if (own === photo) {
          Object.assign(shown, { result, pixels: pixelsOf(result), layer });
          if (after === posts) pending.splice(0, sent);
          draw();
        }
        if (tab === "scene") await recolored();
      }
    })().catch(fail).finally(() => (refreshing = null));
    return refreshing;
  }

  async function recolored() {
    const answer = await fetch(doubts && news.doubt ? "paint/colors/doubt" : "paint/colors", { cache: "no-store" });
    if (!answer.ok) throw new Error(await answer.text());
    await recolor(new Uint16Array(await answer.arrayBuffer()), doubts && news.doubt);
  }

  function fit() {
    const [left, top, right, bottom] = room();
    const { width, height } = photos[photo];
    const scale = Math.min((right - left) / width, (bottom - top) / height);
    view = { scale, x: (left + right - scale * width) / 2, y: (top + bottom - scale * height) / 2 };
    draw();
  }

  /** The part of the easel that nothing lies over: left, top, right, bottom. */
  function room() {
    const [all, brushes, mixer, strip] = [easel, at("brushes"), at("mixer"), at("strip")].map((part) => part.getBoundingClientRect());
    const narrow = mixer.left < all.width / 2;
    const [left, top] = narrow ? [0, brushes.bottom] : [brushes.right, at("paint-bar").getBoundingClientRect().bottom];
    const [right, bottom] = narrow ? [all.width, mixer.top] : [mixer.left, strip.top];
    return [left + 12, top + 12, Math.max(left + 60, right - 12), Math.max(top + 60, bottom - 12)];
  }

  const toPhoto = ({ clientX, clientY }) => [(clientX - view.x) / view.scale, (clientY - view.y) / view.scale];

  function draw() {
    requestAnimationFrame(() => {
      const density = window.devicePixelRatio || 1;
      const [width, height] = [easel.clientWidth, easel.clientHeight].map((side) => Math.max(1, Math.round(side * density)));
      if (easel.width !== width || easel.height !== height) [easel.width, easel.height] = [width, height];
      pen.setTransform(1, 0, 0, 1, 0, 0);
      pen.clearRect(0, 0, width, height);
      const base = shown.result ?? shown.gray;
      if (!base) return;
      const { width: w, height: h } = photos[photo];
      pen.setTransform(density * view.scale, 0, 0, density * view.scale, density * view.x, density * view.y);
      pen.imageSmoothingEnabled = view.scale < 3;
      pen.drawImage(base, 0, 0, w, h);
      if (versus !== "none" && shown.other) {
        pen.save();
        pen.beginPath();
        pen.rect(0, 0, wipe * w, h);
        pen.clip();
        pen.drawImage(shown.other, 0, 0, w, h);
        pen.restore();
      }
      if (shown.layer && (showsStrokes || tool === "eraser")) pen.drawImage(shown.layer, 0, 0, w, h);
      for (const drawn of [...pending, stroke]) if (drawn && drawn.photo === photo) trace(drawn);
      ring();
      placeWipe();
    });
  }

  function trace({ points, color }) {
    pen.fillStyle = pen.strokeStyle = color ? css(color) : "rgb(255 255 255 / 0.5)";
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

  /** The brush, where the pointer is. */
  function ring() {
    if (!pointer || drag) return;
    const [x, y] = pointer;
    const picks = tool === "dropper" || pointer.alt;
    pen.lineWidth = 1.5 / view.scale;
    for (const [style, more] of [["#000", 0], ["#fff", 1.5 / view.scale]]) {
      pen.strokeStyle = style;
      pen.beginPath();
      pen.arc(x, y, (picks ? 5 / view.scale : size / 2) + more, 0, 7);
      pen.stroke();
    }
  }

  function placeWipe() {
    const { width } = photos[photo];
    const handle = at("paint-wipe");
    handle.hidden = at("over-left").hidden = versus === "none" || !shown.other || tab !== "photo";
    const x = view.x + wipe * width * view.scale;
    const { height } = photos[photo];
    Object.assign(handle.style, { left: `${x}px`, top: `${view.y}px`, height: `${height * view.scale}px` });
    Object.assign(at("over-left").style, { left: `${view.x + 8}px`, top: `${view.y + 8}px` });
    at("over-left").textContent = { gray: "Gray", teacher: "Teacher", before: "Before" }[versus] ?? "";
    handle.setAttribute("aria-valuenow", Math.round(100 * wipe));
  }

  async function compareWith(what) {
    versus = what;
    press("versus", "with", what);
    const own = photo;
    shown.other = null;
    if (what !== "none") {
      const other = what === "gray" ? shown.gray : await bitmap(`${what}/${own}`, false);
      if (own !== photo || versus !== what) return;
      shown.other = other;
      shown.otherPixels = other && pixelsOf(other);
      if (!other) note = "no teacher has an answer for this photo";
    }
    showStatus();
    draw();
  }

  function press(id, key, value) {
    for (const button of at(id).querySelectorAll("button")) if (button.dataset[key]) button.setAttribute("aria-pressed", String(button.dataset[key] === value));
  }

  // ---- color

  function mix() {
    const wheel = at("wheel").getContext("2d");
    const image = wheel.createImageData(WHEEL, WHEEL);
    const l = lightness;
    for (let k = 0; k < WHEEL * WHEEL; k++) {
      const [a, b] = [k % WHEEL, Math.floor(k / WHEEL)].map((v) => ((v + 0.5) / WHEEL - 0.5) * 2 * REACH);
      if (Math.hypot(a, b) > REACH) continue;
      const rgb = labToRgb([l, a, -b]);
      const [red, green, blue] = bytes(rgb);
      image.data.set([red, green, blue, shows(rgb) ? 255 : 60], 4 * k);
    }
    wheel.putImageData(image, 0, 0);
    const ab = paintAt(l);
    const [x, y] = [ab[0], -ab[1]].map((v) => (v / (2 * REACH) + 0.5) * WHEEL);
    for (const [style, r] of [["#000", 7], ["#fff", 5.5]]) {
      wheel.strokeStyle = style;
      wheel.lineWidth = 1.5;
      wheel.beginPath();
      wheel.arc(x, y, r, 0, 7);
      wheel.stroke();
    }
    const color = colorAt(l, ab);
    at("swatch").style.background = css(color);
    at("mixed-text").textContent = `a ${Math.round(ab[0])}  b ${Math.round(ab[1])}  at L ${Math.round(l)}`;
  }

  let mixing = false;
  function mixSoon() {
    if (mixing) return;
    mixing = true;
    requestAnimationFrame(() => {
      mixing = false;
      mix();
    });
  }

  const paintAt = (l) => paintOf.map((v) => v * shade(l));

  function take(color) {
    const [l, a, b] = rgbToLab(color);
    paintOf = [a, b].map((v) => v / shade(l));
    if (tool !== "brush") choose("brush");
    mixSoon();
  }

  function onWheel(event) {
    const box = at("wheel").getBoundingClientRect();
    const [a, b] = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height].map((v) => (v - 0.5) * 2 * REACH);
    const far = Math.max(1, Math.hypot(a, b) / REACH);
    paintOf = [a / far, -b / far].map((v) => v / shade(lightness));
    mixSoon();
  }

  function showPalette() {
    const palette = at("palette");
    const colors = JSON.stringify(news.palette);
    if (palette.dataset.colors === colors) return;
    palette.dataset.colors = colors;
    palette.replaceChildren(...news.palette.map((color) => {
      const button = Object.assign(document.createElement("button"), { title: css(color) });
      button.style.background = css(color);
      button.addEventListener("click", () => take(color));
      return button;
    }));
  }

  // ---- tools

  function choose(what) {
    tool = what;
    press("brushes", "tool", tool);
    draw();
  }

  function resizeBrush(to) {
    size = Math.min(100, Math.max(1, Math.round(to)));
    at("size").value = size;
    at("size-shown").textContent = `${size} px`;
    draw();
  }

  const radius = (event) => {
    const pressed = event.pointerType === "pen" && at("pressure").checked ? 0.25 + 0.75 * event.pressure : 1;
    return Math.max(0.5, (size / 2) * pressed);
  };

  /** The mean lightness of the photo under the brush. */
  function lightnessAt([x, y]) {
    if (!shown.levels) return lightness;
    const reach = Math.min(12, size / 2);
    let [sum, count] = [0, 0];
    for (let j = -reach; j <= reach; j += Math.max(1, reach / 4)) {
      for (let i = -reach; i <= reach; i += Math.max(1, reach / 4)) {
        const gray = Math.hypot(i, j) <= reach && pixel(shown.levels, [x + i, y + j]);
        if (gray) [sum, count] = [sum + rgbToLab(gray)[0], count + 1];
      }
    }
    return count > 0 ? sum / count : lightness;
  }

  /** Shows the wheel at the lightness of a place. */
  function look(place) {
    lightness = Math.min(92, Math.max(20, lightnessAt(place)));
    mixSoon();
  }

  /** The same once the pointer rests there, and not on its way to the wheel. */
  function lookSoon(place) {
    clearTimeout(resting);
    resting = setTimeout(() => look(place), RESTS);
  }

  function pick(place) {
    const left = versus !== "none" && shown.otherPixels && place[0] < wipe * photos[photo].width;
    const color = pixel(left ? shown.otherPixels : shown.pixels ?? shown.levels, place);
    if (color) take(color);
  }

  function down(event) {
    easel.focus({ preventScroll: true });
    easel.setPointerCapture(event.pointerId);
    if (event.button === 1 || space) {
      drag = { x: event.clientX - view.x, y: event.clientY - view.y };
      return;
    }
    if (event.button !== 0 || stroke) return;
    const place = toPhoto(event);
    if (tool === "dropper" || event.altKey) return pick(place);
    look(place);
    note = "";
    stroke = { photo, color: tool === "eraser" ? null : colorAt(lightness, paintAt(lightness)), points: [[...place, radius(event)]] };
    draw();
  }

  function move(event) {
    pointer = Object.assign(toPhoto(event), { alt: event.altKey });
    if (drag) {
      view = { ...view, x: event.clientX - drag.x, y: event.clientY - drag.y };
    } else if (stroke) {
      for (const one of event.getCoalescedEvents?.() ?? [event]) {
        const [x, y] = toPhoto(one);
        const [x0, y0, r] = stroke.points[stroke.points.length - 1];
        if (Math.hypot(x - x0, y - y0) >= Math.max(0.5, r / 6)) stroke.points.push([x, y, radius(one)]);
      }
    } else {
      lookSoon(pointer);
    }
    draw();
  }

  function up() {
    drag = null;
    if (!stroke) return;
    const sent = stroke;
    stroke = null;
    pending.push(sent);
    draw();
    post("stroke", sent).catch(() => {
      pending = pending.filter((other) => other !== sent);
      draw();
    });
  }

  function zoom(event) {
    event.preventDefault();
    const [x, y] = toPhoto(event);
    const lines = event.deltaMode === 1 ? 16 : 1;
    const scale = Math.min(ZOOM[1], Math.max(ZOOM[0], view.scale * Math.exp(-WHEEL_STEP * lines * event.deltaY)));
    view = { scale, x: event.clientX - x * scale, y: event.clientY - y * scale };
    draw();
  }

  // ---- what is said

  function showStatus() {
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
    const facts = [said, photos[photo].name];
    if (!news.saved && phase !== "saving") facts.push("strokes kept, run not saved");
    if (!secret) facts.push("open the whole address that the program printed, or nothing can be painted");
    if (note) facts.push(note);
    at("status").textContent = facts.join(" · ");
  }

  function showNews() {
    showStatus();
    showPalette();
    at("copy").title = news.command;
    at("undo").disabled = news.undo === 0;
    at("redo").disabled = news.redo === 0;
    at("save").disabled = news.saved || news.state.phase === "saving";
    for (const [k, item] of [...at("strip").children].entries()) {
      item.classList.toggle("painted", news.painted.includes(k));
      const next = doubts ? (news.doubt ?? []).indexOf(k) : -1;
      item.dataset.next = next < 0 ? "" : next + 1;
    }
  }

  async function follow() {
    for (;;) {
      try {
        const answer = await fetch(`paint/news/${news.version}`, { cache: "no-store" });
        if (!answer.ok) throw new Error(await answer.text());
        const before = news;
        news = await answer.json();
        showNews();
        if (doubts && !news.doubt && news.state.phase !== "solving" && before.state.phase !== news.state.phase) post("doubt");
        const changed = before.colors !== news.colors || before.undo !== news.undo || before.redo !== news.redo;
        if (changed || Boolean(before.doubt) !== Boolean(news.doubt)) refresh();
      } catch (error) {
        news = { ...news, version: 0, state: { phase: "gone" } };
        showStatus();
        await new Promise((done) => setTimeout(done, AGAIN));
      }
    }
  }

  function showTab(what) {
    tab = what;
    root.classList.toggle("scene", tab === "scene");
    press("tabs", "tab", tab);
    at("keys").innerHTML = tab === "scene" ? sceneKeys : KEYS;
    if (tab === "scene") {
      jump(photos[photo].camera);
      recolored().catch(fail);
    }
    draw();
  }

  function toggleDoubt() {
    doubts = !doubts;
    at("doubt").setAttribute("aria-pressed", String(doubts));
    if (doubts && !news.doubt) post("doubt");
    showNews();
    refresh();
  }

  function toggleStrokes() {
    showsStrokes = !showsStrokes;
    at("show-strokes").setAttribute("aria-pressed", String(showsStrokes));
    draw();
  }

  async function copy() {
    await navigator.clipboard.writeText(news.command);
    note = "command copied";
    showStatus();
  }

  /** Keys come here first; those of the scene go on. */
  function key(event) {
    const typing = event.target.closest?.("input[type=text]");
    if (typing) return;
    const held = event.ctrlKey || event.metaKey;
    const keys = held
      ? { z: () => post(event.shiftKey ? "redo" : "undo"), y: () => post("redo"), s: () => at("save").click() }
      : { v: () => showTab(tab === "scene" ? "photo" : "scene"), d: toggleDoubt };
    if (!held && tab === "photo") {
      Object.assign(keys, {
        b: () => choose("brush"), e: () => choose("eraser"), p: () => choose("dropper"), s: toggleStrokes, 0: fit,
        "[": () => resizeBrush(Math.min(size - 1, size / 1.15)), "]": () => resizeBrush(Math.max(size + 1, size * 1.15)),
        arrowleft: () => load(photo - 1).catch(fail), arrowright: () => load(photo + 1).catch(fail), " ": () => (space = true),
        // Of the scene.
        r: fit, i: () => {}, w: () => {}, a: () => {}, q: () => {}, arrowup: () => {}, arrowdown: () => {},
      });
      for (const [k, button] of [...at("versus").children].entries()) keys[k + 1] = () => button.click();
    }
    const does = keys[event.key.toLowerCase()];
    if (!does || event.altKey) return;
    if (event.target.closest?.("button") && event.key === " ") return;
    if (event.target.closest?.("input, #paint-wipe") && event.key.startsWith("Arrow")) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    does();
  }

  function listen() {
    easel.addEventListener("pointerdown", down);
    easel.addEventListener("pointermove", move);
    for (const end of ["pointerup", "pointercancel"]) easel.addEventListener(end, up);
    easel.addEventListener("pointerleave", () => {
      pointer = null;
      clearTimeout(resting);
      draw();
    });
    easel.addEventListener("wheel", zoom, { passive: false });
    easel.addEventListener("contextmenu", (event) => event.preventDefault());
    new ResizeObserver(fit).observe(easel);
    window.addEventListener("keydown", key, { capture: true });
    window.addEventListener("keyup", (event) => event.key === " " && (space = false), { capture: true });
    const wheel = at("wheel");
    wheel.addEventListener("pointerdown", (event) => {
      wheel.setPointerCapture(event.pointerId);
      onWheel(event);
    });
    wheel.addEventListener("pointermove", (event) => wheel.hasPointerCapture(event.pointerId) && onWheel(event));
    at("size").addEventListener("input", () => resizeBrush(Number(at("size").value)));
    at("brushes").addEventListener("click", ({ target }) => target.dataset.tool && choose(target.dataset.tool));
    at("tabs").addEventListener("click", ({ target }) => target.dataset.tab && showTab(target.dataset.tab));
    at("versus").addEventListener("click", ({ target }) => target.dataset.with && compareWith(target.dataset.with).catch(fail));
    at("show-strokes").addEventListener("click", toggleStrokes);
    at("doubt").addEventListener("click", toggleDoubt);
    at("undo").addEventListener("click", () => post("undo"));
    at("redo").addEventListener("click", () => post("redo"));
    at("save").addEventListener("click", () => post("save"));
    at("copy").addEventListener("click", () => copy().catch(fail));
    dragWipe(at("paint-wipe"), easel, (share, event) => {
      const x = event ? event.clientX : easel.clientWidth * share;
      wipe = event ? Math.min(1, Math.max(0, (x - view.x) / (photos[photo].width * view.scale))) : share;
      draw();
    });
  }

  at("strip").replaceChildren(...photos.map(({ name }, k) => {
    const item = Object.assign(document.createElement("button"), { title: name });
    item.setAttribute("role", "option");
    item.append(Object.assign(document.createElement("img"), { src: `paint/thumb/${k}`, alt: name, loading: "lazy" }));
    item.addEventListener("click", () => load(k).catch(fail));
    return item;
  }));
  listen();
  resizeBrush(size);
  choose("brush");
  press("versus", "with", "none");
  showTab("photo");
  mix();
  // For scripts.
  Object.assign(window.gsChroma, {
    easel: () => ({ x: view.x, y: view.y, width: view.scale * photos[photo].width, height: view.scale * photos[photo].height }),
    version: () => news.colors,
    doubt: () => news.doubt,
  });
  const first = photos.findIndex(({ camera }) => camera >= about.first);
  follow();
  await load(Math.max(0, first));
}
