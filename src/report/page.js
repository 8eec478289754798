"use strict";
// What is here needs no server; without it the page shows all pictures, still.

const make = (name, properties = {}) => Object.assign(document.createElement(name), properties);

// Pictures of the path one after the other, where there is no film of them.
for (const figure of document.querySelectorAll("[data-frames]")) {
  const name = (frame) => `frame-${String(frame).padStart(4, "0")}.png`;
  const frames = Number(figure.dataset.frames);
  const picture = figure.querySelector("img");
  const button = make("button", { textContent: "Play" });
  const slider = make("input", { type: "range", min: 0, max: frames - 1, value: 0 });
  slider.setAttribute("aria-label", "frame");
  const show = () => {
    picture.src = name(slider.value);
    picture.parentElement.href = picture.src;
  };
  slider.addEventListener("input", show);
  let timer = 0;
  let loaded;
  button.addEventListener("click", () => {
    // All of them, so that none is missing when its turn comes.
    loaded ??= Array.from({ length: frames }, (_, frame) => make("img", { src: name(frame) }));
    button.textContent = timer ? "Play" : "Pause";
    if (timer) {
      timer = clearInterval(timer);
      return;
    }
    timer = setInterval(() => {
      slider.value = (Number(slider.value) + 1) % frames;
      show();
    }, 1000 / Number(figure.dataset.rate));
  });
  const controls = make("div", { className: "controls" });
  controls.append(button, slider);
  figure.querySelector("figcaption").before(controls);
}

// Of each viewpoint, ours to the left of a line that can be moved, another to the right of it.
for (const row of document.querySelectorAll(".row")) {
  const pictures = new Map();
  for (const figure of row.querySelectorAll("figure")) {
    pictures.set(figure.querySelector("figcaption").textContent, figure.querySelector("img"));
  }
  const ours = pictures.get("ours");
  if (!ours || pictures.size < 2) continue;
  pictures.delete("ours");
  const source = (picture) => picture.getAttribute("src");
  const stack = make("div", { className: "stack" });
  const under = make("img", { alt: "", loading: "lazy" });
  const over = make("img", { className: "over", alt: "", loading: "lazy", src: source(ours) });
  const line = make("input", { type: "range", min: 0, max: 100, step: 0.1, value: 50 });
  line.setAttribute("aria-label", "where ours ends");
  const move = () => stack.style.setProperty("--at", `${line.value}%`);
  line.addEventListener("input", move);
  move();
  stack.append(under, over, line);
  const choice = make("select");
  choice.setAttribute("aria-label", "what ours is compared with");
  for (const name of pictures.keys()) choice.append(make("option", { textContent: name }));
  const first = ["teacher", "photo"].find((name) => pictures.has(name));
  choice.value = first ?? [...pictures.keys()].pop();
  const choose = () => { under.src = source(pictures.get(choice.value)); };
  choice.addEventListener("change", choose);
  choose();
  const caption = make("figcaption");
  caption.append(make("span", { textContent: "ours" }), choice);
  const wipe = make("figure", { className: "wipe" });
  wipe.append(stack, caption);
  row.before(wipe);
}
