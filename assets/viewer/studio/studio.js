// The studio: what goes on and what was made, and buttons that start the program's commands.

const secret = location.hash.slice(1);
const AGAIN = 2000;
const STEPS = ["prepare", "fit", "colorize", "frames", "export", "eval"];
const FORMATS = { ply: "PLY", spz: "SPZ", sog: "SOG", html: "page" };

const at = (id) => document.getElementById(id);

function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

async function post(place, body) {
  const answer = await fetch(place, { method: "POST", headers: { "X-Secret": secret }, body: JSON.stringify(body) });
  if (!answer.ok) throw new Error(await answer.text());
  return answer.json();
}

function say(text, bad = false) {
  at("said").textContent = text;
  at("said").classList.toggle("bad", bad);
}

/** Has a command started or ended. */
async function ask(body) {
  try {
    await post("do", body);
    say("");
  } catch (error) {
    say(error.message, true);
  }
}

const button = (text, body, properties = {}) => {
  const made = element("button", { type: "button", textContent: text, ...properties });
  made.addEventListener("click", () => ask(body));
  return made;
};

// ---- commands

/** The share that a line of progress tells, such as `training 120/3000 after 5 s`. */
function shareOf(line) {
  const [, done, total] = line.match(/ (\d+)\/(\d+) after /) ?? [];
  return total > 0 ? done / total : null;
}

/** The chain of steps, of a line such as `step 2 of 6, fit`. */
function steps(line) {
  const now = STEPS.findIndex((step) => line.split(", ")[1]?.startsWith(step));
  const item = (step, k) => element("li", { textContent: step, className: k < now ? "done" : k === now ? "now" : "" });
  return element("ol", { className: "steps", ariaLabel: line }, ...STEPS.map(item));
}

const NAMES = { auto: "Making", view: "Showing", frames: "Coloring the photos of", export: "Exporting", teacher: "Fetching" };

function job({ number, phase, step, doing, warnings, url, command, makes, subject }) {
  const goes = phase === "going" || phase === "stopping";
  const does = command.endsWith(" --paint") ? "Painting" : NAMES[command.split(" ")[1]];
  const said = { going: "", stopping: "stopping: it writes what it needs to continue", stopped: "stopped", done: "done", failed: "failed" }[phase];
  const head = element("div", { className: "row" }, element("h3", { textContent: `${does} ${subject ?? ""}${said && ` · ${said}`}` }));
  const buttons = element("div", { className: "row" });
  if (url) buttons.append(element("a", { className: "button main", href: url, target: "_blank", rel: "noopener", textContent: makes ? "Watch" : "Open" }));
  if (goes) buttons.append(button(url && !makes ? "Close" : "Stop", { do: "stop", job: number }, { disabled: phase === "stopping" }));
  head.append(buttons);
  const card = element("article", { className: "card job" }, head);
  card.dataset.phase = phase;
  if (makes && step) card.append(steps(step));
  const share = goes ? shareOf(doing) : null;
  if (share !== null) card.append(element("progress", { value: share }));
  if (doing && (makes || !url) && phase !== "done") card.append(element("p", { textContent: doing, className: phase === "failed" ? "bad" : "" }));
  if (warnings.length > 0) {
    const list = element("ul", {}, ...warnings.map((warning) => element("li", { textContent: warning })));
    card.append(element("details", { open: goes }, element("summary", { textContent: `${warnings.length} warnings` }), list));
  }
  card.append(element("code", { textContent: command }));
  return card;
}

// ---- scenes

const size = (bytes) => (bytes < 1e6 ? `${Math.ceil(bytes / 1e3)} KB` : `${(bytes / 1e6).toFixed(1)} MB`);

function run({ id, name, path, gray, colored, resumes, picture, files, film }) {
  const card = element("article", { className: "card run" });
  card.dataset.name = name;
  card.append(picture === null ? element("div", { className: "none" }) : element("img", { src: `picture/${id}/${picture}`, alt: name }));
  const state = colored ? "in color" : gray ? "gray" : "not finished";
  const buttons = element("div", { className: "row" });
  if (gray) buttons.append(button("View", { do: "view", run: id }));
  if (gray) buttons.append(button("Paint", { do: "paint", run: id }));
  if (colored) buttons.append(button(film ? "Film in color" : "Photos in color", { do: "frames", run: id, film }));
  if (resumes && !colored) buttons.append(button("Resume", { do: "resume", run: id }, { className: "main" }));
  const body = element("div", {}, element("h3", { textContent: name, title: path }), element("small", { textContent: state }), buttons);
  if (colored) {
    const formats = Object.entries(FORMATS).map(([format, title]) => button(title, { do: "export", run: id, format }));
    body.append(element("div", { className: "row" }, element("small", { textContent: "Export" }), ...formats));
  }
  const links = files.map((file, k) => element("a", { href: `file/${id}/${k}`, download: file.name, textContent: `${file.name}, ${size(file.bytes)}` }));
  if (links.length > 0) body.append(element("div", { className: "row files" }, element("small", { textContent: "Download" }), ...links));
  card.append(body);
  return card;
}

// ---- the page

/** Puts cards in the place of those that differ: pictures that stay do not flicker. */
function put(place, kind, values) {
  const old = new Map([...place.children].map((card) => [card.dataset.made, card]));
  const cards = values.map((value) => {
    const made = JSON.stringify(value);
    const card = old.get(made) ?? kind(value);
    card.dataset.made = made;
    return card;
  });
  if (cards.some((card, k) => place.children[k] !== card) || place.children.length !== cards.length) place.replaceChildren(...cards);
}

function show({ folder, jobs, runs }) {
  at("folder").textContent = folder;
  put(at("jobs"), job, jobs);
  const busy = jobs.some(({ makes, phase }) => makes && (phase === "going" || phase === "stopping"));
  put(at("runs"), run, runs.map((known) => ({ ...known, resumes: known.resumes && !busy })));
}

async function follow() {
  let version = -1;
  for (;;) {
    try {
      const news = await post("news", version < 0 ? 0 : version);
      if (version < 0 || at("said").textContent.startsWith("gs-chroma has ended")) say("");
      version = news.version;
      show(news);
    } catch (error) {
      say(secret ? "gs-chroma has ended. Start it again, and open its new address." : "Open the whole address that the program printed.", true);
      await new Promise((done) => setTimeout(done, AGAIN));
    }
  }
}

at("input").addEventListener("change", () => {
  const name = at("input").value.replace(/[/\\]+$/, "").split(/[/\\]/).pop().replace(/\.[^.]*$/, "");
  if (!at("name").value) at("name").value = name.replace(/[^\p{L}\p{N} ._-]/gu, "-");
});
at("make").addEventListener("submit", (event) => {
  event.preventDefault();
  const value = (id) => at(id).value.trim();
  ask({ do: "make", input: value("input"), name: value("name"), teacher: value("teacher"), preset: value("preset") || null, options: value("options") });
});
at("fetch").addEventListener("click", () => ask({ do: "fetch", teacher: at("teacher").value.trim() }));
follow();
