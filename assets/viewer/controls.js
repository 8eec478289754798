// Mouse, touch and keys to moves of the camera.

const TURN = 0.005; // radians a pixel
const WHEEL = 0.0015; // of the distance, a unit of the wheel
const SPEED = 0.7; // distances a second
const FASTER = 4;

const MOVES = {
  KeyW: [0, 0, 1], ArrowUp: [0, 0, 1], KeyS: [0, 0, -1], ArrowDown: [0, 0, -1],
  KeyA: [-1, 0, 0], ArrowLeft: [-1, 0, 0], KeyD: [1, 0, 0], ArrowRight: [1, 0, 0],
  KeyQ: [0, 1, 0], KeyE: [0, -1, 0],
};

/** Moves `camera` as the user drags on `canvas` and presses keys; calls `moved` after each. */
export function control(canvas, camera, moved) {
  const pointers = new Map();
  const keys = new Set();
  const held = { last: 0 };

  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
    canvas.focus({ preventScroll: true });
  });
  for (const end of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
  }
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const [x, y] = [event.clientX - before.clientX, event.clientY - before.clientY];
    if (pointers.size === 1) {
      pointers.set(event.pointerId, event);
      if (event.buttons === 2 || event.buttons === 4 || event.shiftKey) pan(x, y);
      else camera.orbit(TURN * x, TURN * y);
    } else if (pointers.size === 2) {
      const spread = () => {
        const [a, b] = [...pointers.values()];
        return { apart: Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY), x: (a.clientX + b.clientX) / 2, y: (a.clientY + b.clientY) / 2 };
      };
      const was = spread();
      pointers.set(event.pointerId, event);
      const is = spread();
      pan(is.x - was.x, is.y - was.y);
      if (is.apart > 0 && was.apart > 0) camera.dolly(was.apart / is.apart);
    }
    moved();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    camera.dolly(Math.exp(WHEEL * lines * event.deltaY));
    moved();
  }, { passive: false });

  // What is under the pointer stays under it.
  function pan(x, y) {
    const { scale } = camera.fitted(canvas.clientWidth, canvas.clientHeight);
    camera.move(-x / (scale * camera.lens.fx), -y / (scale * camera.lens.fy), 0);
  }

  function fly(now) {
    if (keys.size === 0) return;
    const seconds = Math.min((now - held.last) / 1000, 0.25);
    held.last = now;
    const fast = keys.has("ShiftLeft") || keys.has("ShiftRight") ? FASTER : 1;
    for (const key of keys) {
      const move = MOVES[key];
      if (move) camera.move(...move.map((part) => part * SPEED * fast * seconds));
    }
    moved();
    requestAnimationFrame(fly);
  }
  window.addEventListener("keydown", (event) => {
    const known = event.code in MOVES || event.code.startsWith("Shift");
    if (!known || event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, select")) return;
    if (event.code in MOVES) event.preventDefault();
    const still = keys.size === 0;
    keys.add(event.code);
    if (still) {
      held.last = performance.now();
      requestAnimationFrame(fly);
    }
  });
  window.addEventListener("keyup", (event) => keys.delete(event.code));
  window.addEventListener("blur", () => keys.clear());
}
