// What is laid beside the scene: photo, teacher and error at a photographed camera, and the
// wipe between the two.

/** The error that is shown brightest, in shares of the way from black to white. */
const BRIGHTEST = 0.25;

/** Moves the wipe while it is dragged; `moved` hears of its place, from 0 to 1, and the event. */
export function dragWipe(handle, stage, moved) {
  handle.addEventListener("pointerdown", (event) => {
    handle.setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  handle.addEventListener("pointermove", (event) => {
    if (!handle.hasPointerCapture(event.pointerId)) return;
    const box = stage.getBoundingClientRect();
    moved(Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)), event);
  });
  handle.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
    if (!step) return;
    event.stopPropagation();
    const now = Number(handle.getAttribute("aria-valuenow")) / 100;
    moved(Math.min(1, Math.max(0, now + step)));
  });
}

/** Lays a picture over the place that the lens's picture has in the stage. */
export function place(picture, camera, stage) {
  const { scale, left, top } = camera.fitted(stage.clientWidth, stage.clientHeight);
  Object.assign(picture.style, {
    left: `${left}px`,
    top: `${top}px`,
    width: `${scale * camera.lens.width}px`,
    height: `${scale * camera.lens.height}px`,
  });
}

/** The pixels of an image at a size, RGBA. */
async function pixelsOf(url, width, height) {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error(await answer.text());
  const bitmap = await createImageBitmap(await answer.blob(), { colorSpaceConversion: "none" });
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(bitmap, 0, 0, width, height);
  return context.getImageData(0, 0, width, height).data;
}

const gray = (pixels, k) => (0.2126 * pixels[k] + 0.7152 * pixels[k + 1] + 0.0722 * pixels[k + 2]) / 255;

/** Draws how far a picture's gray is from a photo's into `canvas`; gives the PSNR in dB. */
export async function drawError(canvas, pixels, { width, height }, photo) {
  const wanted = await pixelsOf(photo, width, height);
  const image = new ImageData(width, height);
  let squares = 0;
  for (let k = 0; k < wanted.length; k += 4) {
    const error = gray(pixels, k) - gray(wanted, k);
    squares += error * error;
    const strong = Math.min(1, Math.abs(error) / BRIGHTEST);
    // Too bright is red, too dark is blue, right is black.
    image.data[k] = 255 * (error > 0 ? strong : 0.25 * strong);
    image.data[k + 1] = 255 * 0.45 * strong;
    image.data[k + 2] = 255 * (error > 0 ? 0.15 * strong : strong);
    image.data[k + 3] = 255;
  }
  canvas.width = width;
  canvas.height = height;
  canvas.getContext("2d").putImageData(image, 0, 0);
  return -10 * Math.log10(Math.max((4 * squares) / wanted.length, 1e-10));
}
