// Where scene, photos and figures come from: the program, or this very file.
import { fromBase64, unpack } from "./scene.js";

/** From `gs-chroma view`, which serves this page. */
export class Served {
  constructor() {
    this.tag = null;
  }

  /** What is known of the scene; null where nothing has changed since. */
  async about() {
    const headers = this.tag ? { "If-None-Match": this.tag } : {};
    const answer = await fetch("scene.json", { headers, cache: "no-store" });
    if (answer.status === 304) return null;
    if (!answer.ok) throw new Error(await answer.text());
    this.tag = answer.headers.get("ETag");
    return answer.json();
  }

  async scene(kind) {
    const answer = await fetch(`scene/${kind}`, { cache: "no-store" });
    if (!answer.ok) throw new Error(await answer.text());
    return unpack(new Uint8Array(await answer.arrayBuffer()));
  }

  /** A picture of view `k`: "photo" or "teacher". */
  picture(kind, k) {
    return `${kind}/${k}`;
  }
}

/** From scene.html, which holds all there is. */
export class Embedded {
  constructor(about) {
    this.text = about.textContent;
  }

  async about() {
    return JSON.parse(this.text);
  }

  async scene(kind) {
    const held = document.getElementById(`scene-${kind}`);
    const bytes = fromBase64(held.textContent);
    held.remove();
    return unpack(bytes);
  }

  picture() {
    return null;
  }
}

export function source() {
  const about = document.getElementById("scene-about");
  return about ? new Embedded(about) : new Served();
}
