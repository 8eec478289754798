// Figures of the run: a table, curves, and the plan of effects.

const SVG = "http://www.w3.org/2000/svg";

function element(name, text, parent) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  parent?.append(made);
  return made;
}

function drawn(name, attributes, parent) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  parent.append(made);
  return made;
}

function rows(parent, pairs) {
  const table = element("table", undefined, parent);
  for (const [name, value] of pairs) {
    const row = element("tr", undefined, table);
    element("th", name, row).scope = "row";
    element("td", value, row);
  }
}

const [WIDTH, HEIGHT, LEFT, BOTTOM] = [260, 90, 34, 14];

/** A curve through points (x, y), with its least and greatest values beside it. */
function curve(parent, title, unit, points) {
  const known = points.filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y));
  if (known.length < 2) return;
  element("h3", title, parent);
  const [xs, ys] = [known.map(([x]) => x), known.map(([, y]) => y)];
  const [x0, x1] = [Math.min(...xs), Math.max(...xs)];
  const [y0, y1] = [Math.min(...ys), Math.max(...ys)];
  const svg = drawn("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": `${title}, from ${y0} to ${y1} ${unit}` }, parent);
  const right = (x) => LEFT + ((x - x0) / (x1 - x0 || 1)) * (WIDTH - LEFT - 4);
  const down = (y) => 6 + ((y1 - y) / (y1 - y0 || 1)) * (HEIGHT - BOTTOM - 10);
  const line = known.map(([x, y]) => `${right(x).toFixed(1)},${down(y).toFixed(1)}`).join(" ");
  drawn("polyline", { points: line }, svg);
  const word = (x, y, anchor, text) => (drawn("text", { x, y, "text-anchor": anchor }, svg).textContent = text);
  const short = (value) => (Math.abs(value) >= 10 ? value.toFixed(1) : value.toPrecision(2));
  word(LEFT - 4, 10, "end", short(y1));
  word(LEFT - 4, HEIGHT - BOTTOM, "end", short(y0));
  word(LEFT, HEIGHT - 2, "start", x0);
  word(WIDTH - 4, HEIGHT - 2, "end", `${x1} iterations`);
}

/** Shows what is known of a scene. */
export function showPanel(panel, about) {
  panel.replaceChildren();
  element("h2", about.name, panel);
  rows(panel, about.figures);
  const { psnr = [], loss = [] } = about.curves ?? {};
  curve(panel, "PSNR of held-out photos, dB", "dB", psnr);
  curve(panel, "Loss", "", loss);
  if (about.plan?.length) {
    element("h3", "Effects", panel);
    const list = element("ul", undefined, panel);
    for (const { effect, on, why } of about.plan) {
      const item = element("li", undefined, list);
      element("strong", `${effect}: ${on ? "on" : "off"}`, item);
      item.append(` ${why}`);
    }
  }
}
