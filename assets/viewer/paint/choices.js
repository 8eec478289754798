// Options of the command that colors the run, and the command itself.
import { post } from "./talk.js";

const at = (id) => document.getElementById(id);

export const CHOICES = `<aside id="choices" aria-label="Options" hidden>
  <h2>Colors are saved with</h2>
  <div id="teachers"></div>
  <button id="add-teacher">Add a teacher</button>
  <label>Strength of the teachers <output id="strength-shown"></output><input id="strength" type="range" min="0" max="1" step="0.05"></label>
  <label>SH degree of a and b <select id="degree"><option>0</option><option>1</option><option>2</option><option>3</option></select></label>
  <label>Outlier threshold, CIELAB units <input id="robust" type="number" min="1" max="100" step="1" placeholder="off"></label>
  <p>Save runs this command:</p>
  <code id="command"></code>
  <button id="copy">Copy command</button>
  <p id="choices-said" role="status"></p>
</aside>`;

export class Choices {
  constructor() {
    this.shown = "";
    for (const id of ["strength", "degree", "robust"]) at(id).addEventListener("change", () => this.send());
    at("strength").addEventListener("input", () => (at("strength-shown").textContent = Number(at("strength").value).toFixed(2)));
    at("add-teacher").addEventListener("click", () => this.add("", 1));
    at("teachers").addEventListener("change", () => this.send());
    at("copy").addEventListener("click", async () => {
      await navigator.clipboard.writeText(at("command").textContent);
      at("choices-said").textContent = "Copied";
    });
  }

  add(name, weight) {
    const row = document.createElement("p");
    const input = (properties, label) => {
      const made = Object.assign(document.createElement("input"), properties);
      made.setAttribute("aria-label", label);
      return made;
    };
    row.append(
      input({ type: "text", value: name, placeholder: "network or folder", spellcheck: false }, "Teacher"),
      input({ type: "number", value: weight, min: 0.1, step: 0.1 }, "Weight"),
    );
    at("teachers").append(row);
  }

  /** Shows what the program knows. */
  show({ choices, command }) {
    at("command").textContent = command;
    const known = JSON.stringify(choices);
    if (!choices || known === this.shown) return;
    this.shown = known;
    at("teachers").replaceChildren();
    for (const [name, weight] of choices.teachers) this.add(name, weight);
    at("strength").value = choices.strength;
    at("strength-shown").textContent = choices.strength.toFixed(2);
    at("degree").value = choices.sh_degree;
    at("robust").value = choices.robust ?? "";
  }

  send() {
    const rows = [...at("teachers").children].map((row) => [...row.querySelectorAll("input")].map((input) => input.value));
    const choices = {
      teachers: rows.filter(([name]) => name.trim()).map(([name, weight]) => [name.trim(), Number(weight)]),
      strength: Number(at("strength").value),
      sh_degree: Number(at("degree").value),
      robust: at("robust").value === "" ? null : Number(at("robust").value),
    };
    at("choices-said").textContent = "";
    post("choices", choices).catch((error) => (at("choices-said").textContent = error.message));
  }
}
