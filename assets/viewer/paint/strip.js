// The filmstrip: photos, how much of each the scene covers, which have strokes, and which to paint next.
import { json } from "./talk.js";

const at = (id) => document.getElementById(id);

export const STRIP = `<div id="strip" role="listbox" aria-label="Photos"></div>`;

export class Strip {
  /** `chosen` hears which photo is wanted. */
  constructor(photos, chosen) {
    this.items = photos.map(({ name }, k) => {
      const item = Object.assign(document.createElement("button"), { title: name });
      item.setAttribute("role", "option");
      const image = Object.assign(document.createElement("img"), { src: `paint/thumb/${k}`, alt: name, loading: "lazy" });
      image.addEventListener("load", () => this.cover(item, k), { once: true });
      item.append(image);
      item.addEventListener("click", () => chosen(k));
      return item;
    });
    at("strip").replaceChildren(...this.items);
  }

  /** Shows how much of a photo the scene covers; one is asked for after the other. */
  cover(item, k) {
    this.asked = (this.asked ?? Promise.resolve()).then(async () => {
      const share = Math.round(100 * (await json(`cover/${k}`)));
      item.title += `: the scene covers ${share} %`;
      item.style.setProperty("--cover", `${share}%`);
    }).catch(() => {});
  }

  /** Marks the photo that is shown. */
  select(photo) {
    for (const [k, item] of this.items.entries()) {
      item.setAttribute("aria-selected", String(k === photo));
      if (k === photo) item.scrollIntoView({ block: "nearest", inline: "nearest" });
    }
  }

  /** Marks photos with strokes, and the places to paint next by their numbers. */
  show(painted, places) {
    for (const [k, item] of this.items.entries()) {
      item.classList.toggle("painted", painted.includes(k));
      const next = places.findIndex(([, photo]) => photo === k);
      item.dataset.next = next < 0 ? "" : next + 1;
    }
  }
}
