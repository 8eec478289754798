// The filmstrip: photos, which of them have strokes, and which to paint next.

const at = (id) => document.getElementById(id);

export const STRIP = `<div id="strip" role="listbox" aria-label="Photos"></div>`;

export class Strip {
  /** `chosen` hears which photo is wanted. */
  constructor(photos, chosen) {
    this.items = photos.map(({ name }, k) => {
      const item = Object.assign(document.createElement("button"), { title: name });
      item.setAttribute("role", "option");
      item.append(Object.assign(document.createElement("img"), { src: `paint/thumb/${k}`, alt: name, loading: "lazy" }));
      item.addEventListener("click", () => chosen(k));
      return item;
    });
    at("strip").replaceChildren(...this.items);
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
