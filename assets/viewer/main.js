// The page: what is on the screen and what the buttons do.
import { Camera, add, distanceOf, photographedView, times, upOf } from "./camera.js";
import { drawError, dragWipe, place } from "./compare.js";
import { control } from "./controls.js";
import { showPanel } from "./panel.js";
import { DRAWN, Renderer } from "./renderer.js";
import { Sorter } from "./sorter.js";
import { source } from "./source.js";

const at = (id) => document.getElementById(id);
const [stage, canvas, status] = [at("stage"), at("scene"), at("status")];

// While the camera moves, pictures that take longer than this many milliseconds are drawn
// coarser; a while after it stands still, once more at full size.
const PATIENCE = 60;
const COARSEST = 0.25;
const STILL = 200;
/** Milliseconds between two questions whether a scene that grows has grown. */
const ASK_EVERY = 2000;
/** Pixels of the canvas for one of the page, at most. */
const DENSEST = 2;

const from = source();
const camera = new Camera();
/** The scenes by kind, "color" and "luma", as far as they are loaded. */
const scenes = new Map();
let about = null;
let renderer = null;
let sorter = null;
let main = "color";
/** The photographed camera whose place is taken, and what is beside its picture. */
let photographed = null;
let beside = "none";
let wipe = 0.5;
/** How coarse pictures are while the camera moves: as fast as this device needs it. */
let scale = 1;
let wanted = false;
let drawing = false;
/** Runs until the camera has stood still for a while. */
let still = null;
let psnr = null;

const near = () => about.near;
const parts = () => {
  const scene = scenes.get(main);
  const luma = scenes.get("luma");
  if (beside !== "luma" || !luma) return [{ scene, from: 0, to: 1 }];
  return [{ scene: luma, from: 0, to: wipe }, { scene, from: wipe, to: 1 }];
};

/** Loads a scene, in the place of an older one of its kind. */
async function load(kind) {
  const unpacked = await from.scene(kind);
  const old = scenes.get(kind);
  const key = `${kind} ${performance.now()}`;
  sorter.add(key, unpacked.means);
  const uploaded = { ...renderer.upload(unpacked), key };
  await sortFor(uploaded, currentView());
  scenes.set(kind, uploaded);
  if (old) {
    renderer.release(old);
    sorter.remove(old.key);
  }
  return unpacked;
}

/** Brings a scene into the order of a view. */
async function sortFor(scene, view) {
  const row = depthRow(view);
  const order = await sorter.sort(scene.key, row, view.near);
  renderer.order(scene, order);
  scene.sorted = row;
}

const depthRow = (view) => [...view.rotation.slice(6, 9), view.translation[2]];

function currentView() {
  return camera.view(canvas.width, canvas.height, near());
}

/** Sorts meanwhile, if the order is another view's; draws again when it is done. */
function catchUp(scene, view) {
  if (scene.sorting || depthRow(view).every((value, k) => value === scene.sorted[k])) return;
  scene.sorting = true;
  sortFor(scene, view).finally(() => {
    scene.sorting = false;
    redraw();
  });
}

/** Draws soon. */
function redraw() {
  wanted = true;
  if (!drawing) requestAnimationFrame(frame);
}

async function frame() {
  if (drawing || !wanted || !scenes.has(main)) return;
  [drawing, wanted] = [true, false];
  const view = currentView();
  const shown = parts();
  const begun = performance.now();
  for (const { scene } of shown) catchUp(scene, view);
  renderer.draw(view, shown, { drawn: DRAWN[at("drawn").value], scale: still ? scale : 1 });
  // The next frame comes when this one is on the screen.
  await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  if (still && performance.now() - begun > PATIENCE) scale = Math.max(COARSEST, scale * 0.7);
  drawing = false;
  if (wanted) requestAnimationFrame(frame);
}

/** The camera has moved. */
function moved() {
  if (photographed !== null) leavePhoto();
  clearTimeout(still);
  still = setTimeout(() => {
    still = null;
    redraw();
  }, STILL);
  redraw();
}

function resize() {
  const density = Math.min(window.devicePixelRatio || 1, DENSEST);
  canvas.width = Math.max(1, Math.round(stage.clientWidth * density));
  canvas.height = Math.max(1, Math.round(stage.clientHeight * density));
  showBeside();
  redraw();
}

/** The first view: from a photographed camera, or all of the scene. */
function reset() {
  const { means } = scenes.get(main);
  camera.up = upOf(about.cameras);
  leavePhoto();
  if (about.cameras.length > 0) return jump(about.first);
  camera.take(about.start, distanceOf(about.start, means));
  redraw();
}

/** Takes the place of photographed camera `k`. */
function jump(k) {
  if (about.cameras.length === 0) return;
  photographed = (k + about.cameras.length) % about.cameras.length;
  const chosen = about.cameras[photographed];
  camera.take(chosen, distanceOf(chosen, scenes.get(main).means));
  at("camera").value = photographed;
  psnr = null;
  showBeside();
  redraw();
}

function leavePhoto() {
  photographed = null;
  at("camera").value = "";
  if (beside !== "luma") beside = "none";
  showBeside();
}

async function compareWith(what) {
  if (at("compare").querySelector(`[data-with=${what}]`)?.disabled !== false) return;
  if (what !== "none" && what !== "luma" && photographed === null) jump(closest());
  beside = what;
  psnr = null;
  if (what === "luma" && !scenes.has("luma")) await load("luma");
  showBeside();
  redraw();
}

/** The photographed camera that is nearest. */
function closest() {
  const apart = about.cameras.map((photographed) => {
    const other = new Camera();
    other.take(photographed, 1);
    return Math.hypot(...add(camera.eye, times(other.eye, -1)));
  });
  return apart.indexOf(Math.min(...apart));
}

const LABELS = { luma: "Luma", photo: "Photo", teacher: "Teacher", error: "Error" };

function showBeside() {
  if (!about) return;
  const overlay = photographed !== null && ["photo", "teacher", "error"].includes(beside);
  const isSplit = overlay || beside === "luma";
  for (const button of at("compare").children) {
    button.setAttribute("aria-pressed", String(button.dataset.with === beside));
  }
  at("beside").hidden = !overlay;
  for (const id of ["wipe", "label-left", "label-right"]) {
    at(id).hidden = !isSplit;
    at(id).style.left = `${100 * wipe}%`;
  }
  at("wipe").setAttribute("aria-valuenow", Math.round(100 * wipe));
  at("beside").style.clipPath = `inset(0 ${100 * (1 - wipe)}% 0 0)`;
  at("label-left").textContent = LABELS[beside] ?? "";
  at("label-right").textContent = main === "color" ? "Color" : "Luma";
  showStatus();
  if (!overlay) return;
  const [picture, error] = [at("picture"), at("error")];
  [picture.hidden, error.hidden] = [beside === "error", beside !== "error"];
  place(beside === "error" ? error : picture, camera, stage);
  if (beside !== "error") {
    const url = from.picture(beside, photographed);
    if (picture.getAttribute("src") !== url) picture.src = url;
  } else if (psnr === null) {
    psnr = NaN;
    measure(photographed).catch(fail);
  }
}

async function measure(k) {
  if (about.scenes.includes("luma") && !scenes.has("luma")) await load("luma");
  const view = photographedView(about.cameras[k], near());
  const scene = scenes.get("luma") ?? scenes.get(main);
  await sortFor(scene, view);
  const found = await drawError(at("error"), renderer.read(view, scene), view, from.picture("photo", k));
  await sortFor(scene, currentView());
  if (photographed !== k) return;
  psnr = found;
  showStatus();
}

function showStatus() {
  const { count, degree } = scenes.get(main) ?? {};
  // Paint mode has a status of its own.
  if (count === undefined || about.paint) return;
  const facts = [`${count.toLocaleString("en")} Gaussians, degree ${degree}`];
  if (about.live) facts.push(about.live);
  if (photographed !== null) {
    const { name, split, psnr: known } = about.cameras[photographed];
    facts.push(`${name}${split === "test" ? ", held out" : ""}${known ? `, ${known.toFixed(1)} dB` : ""}`);
  }
  if (beside === "error" && psnr) facts.push(`luma here ${psnr.toFixed(1)} dB; red too bright, blue too dark`);
  status.textContent = facts.join(" · ");
}

function fail(error) {
  status.textContent = error.message;
  console.error(error);
}

function showAbout() {
  at("name").textContent = document.title = about.name;
  showPanel(at("panel"), about);
  const select = at("camera");
  const free = new Option("free view", "");
  select.replaceChildren(free, ...about.cameras.map(({ name }, k) => new Option(name, k)));
  free.disabled = true;
  const has = { none: true, luma: main !== "luma" && about.scenes.includes("luma"), photo: about.photos, teacher: about.teacher, error: about.photos };
  for (const button of at("compare").children) {
    button.disabled = !has[button.dataset.with];
    button.hidden = button.disabled && button.dataset.with !== "teacher";
  }
  at("compare").hidden = Object.values(has).filter(Boolean).length < 2;
  for (const id of ["previous", "camera", "next"]) at(id).hidden = about.cameras.length === 0;
  at("photos").hidden = about.cameras.length === 0 && at("compare").hidden;
}

function toggle(button, panel) {
  const shown = at(panel).hidden;
  for (const [other, id] of [["about", "panel"], ["help", "keys"]]) {
    const open = id === panel && shown;
    at(id).hidden = !open;
    at(other).setAttribute("aria-expanded", String(open));
  }
}

function listen() {
  control(canvas, camera, moved);
  canvas.addEventListener("webglcontextlost", () => fail(new Error("the graphics device was lost: reload the page")));
  dragWipe(at("wipe"), stage, (share) => {
    wipe = share;
    showBeside();
    if (beside === "luma") redraw();
  });
  at("drawn").addEventListener("change", redraw);
  at("reset").addEventListener("click", reset);
  at("about").addEventListener("click", () => toggle("about", "panel"));
  at("help").addEventListener("click", () => toggle("help", "keys"));
  at("previous").addEventListener("click", () => jump((photographed ?? 0) - 1));
  at("next").addEventListener("click", () => jump((photographed ?? -1) + 1));
  at("camera").addEventListener("change", (event) => jump(Number(event.target.value)));
  at("compare").addEventListener("click", ({ target }) => target.dataset.with && compareWith(target.dataset.with).catch(fail));
  at("picture").addEventListener("error", () => (status.textContent = "this picture is not there"));
  new ResizeObserver(resize).observe(stage);
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, select")) return;
    const keys = {
      r: reset,
      "[": () => at("previous").click(),
      "]": () => at("next").click(),
      i: () => toggle("about", "panel"),
      "?": () => toggle("help", "keys"),
      Escape: () => toggle("", ""),
    };
    for (const [k, button] of [...at("compare").children].entries()) keys[k + 1] = () => button.click();
    keys[event.key]?.();
  });
}

/** Looks now and then whether the scene has grown, as long as somebody looks at the page. */
async function follow() {
  for (;;) {
    await new Promise((done) => setTimeout(done, ASK_EVERY));
    if (document.hidden) continue;
    try {
      const now = await from.about();
      if (!now) continue;
      const before = about;
      about = now;
      if (before.scenes.join() !== now.scenes.join() && now.scenes.includes("color")) main = "color";
      for (const kind of new Set([main, ...scenes.keys()])) {
        if (!scenes.has(kind) || before.stamps[kind] !== now.stamps[kind]) await load(kind);
      }
      showAbout();
      at("camera").value = photographed ?? "";
      psnr = null;
      showBeside();
      redraw();
    } catch (error) {
      about.live = "gs-chroma has ended; this is what was seen last";
      showStatus();
    }
  }
}

async function begin() {
  about = await from.about();
  while (about.scenes.length === 0) {
    at("name").textContent = about.name;
    status.textContent = about.live ?? "Nothing to see yet";
    await new Promise((done) => setTimeout(done, ASK_EVERY / 2));
    about = (await from.about()) ?? about;
  }
  main = about.scenes[0];
  renderer = new Renderer(canvas);
  sorter = new Sorter();
  const density = Math.min(window.devicePixelRatio || 1, DENSEST);
  [canvas.width, canvas.height] = [stage.clientWidth * density, stage.clientHeight * density].map(Math.round);
  await load(main);
  showAbout();
  listen();
  reset();
  at("poster").hidden = true;
  if (about.live) follow();
  if (about.paint) await (await import("./paint/paint.js")).paint({ about, jump, recolor, dragWipe, camera: viewOfPage, fitted });
}

/** The view of the page, in its own pixels. */
function viewOfPage() {
  const { width, height, fx, fy, cx, cy, rotation, translation } = camera.view(stage.clientWidth, stage.clientHeight, near());
  return { width, height, fx, fy, cx, cy, rotation, translation };
}

/** Where the camera's own picture lies on the page, in its pixels. */
function fitted() {
  const { scale, left, top } = camera.fitted(stage.clientWidth, stage.clientHeight);
  return { x: left, y: top, width: scale * camera.lens.width, height: scale * camera.lens.height };
}

/** Shows the scene in other colors: halves as its own. */
function recolor(colors) {
  const scene = scenes.get("color");
  if (colors.length !== scene.colors.length) return load("color").then(redraw);
  renderer.recolor(scene, colors);
  redraw();
}

/** For scripts: `await gsChroma.ready`, then `await gsChroma.picture(k)`. */
window.gsChroma = {
  ready: begin().catch((error) => {
    fail(error);
    throw error;
  }),
  /** Names of the photographed cameras. */
  names: () => about.cameras.map(({ name }) => name),
  /** Takes the place of a photographed camera. */
  jump,
  /** The picture of photographed camera `k` at its own size: a PNG as a data URL. */
  async picture(k, kind = main) {
    if (!scenes.has(kind)) await load(kind);
    const view = photographedView(about.cameras[k], near());
    const scene = scenes.get(kind);
    await sortFor(scene, view);
    const pixels = renderer.read(view, scene);
    const held = document.createElement("canvas");
    [held.width, held.height] = [view.width, view.height];
    held.getContext("2d").putImageData(new ImageData(pixels, view.width, view.height), 0, 0);
    return held.toDataURL("image/png");
  },
  /** Turns the free camera by radians and draws; gives the milliseconds it took. */
  async turn(right, down) {
    const begun = performance.now();
    camera.orbit(right, down);
    leavePhoto();
    const view = currentView();
    await Promise.all(parts().map(({ scene }) => sortFor(scene, view)));
    renderer.draw(view, parts(), { drawn: DRAWN[at("drawn").value] });
    renderer.wait();
    return performance.now() - begun;
  },
};
