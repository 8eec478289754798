// Pixels of pictures, to be looked up.
import { rgbToLab } from "./color.js";

/** The pixels of a picture. */
export function pixelsOf(image) {
  const held = new OffscreenCanvas(image.width, image.height);
  const context = held.getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, image.width, image.height);
}

/** sRGB of the pixel at a place; null outside. */
export function pixelAt({ data, width, height }, [x, y]) {
  const [i, j] = [Math.floor(x), Math.floor(y)];
  if (i < 0 || j < 0 || i >= width || j >= height) return null;
  return [...data.subarray(4 * (j * width + i), 4 * (j * width + i) + 3)];
}

/** The mean lightness around a place; null outside. */
export function lightnessAt(pixels, [x, y], reach) {
  let [sum, count] = [0, 0];
  const step = Math.max(1, reach / 4);
  for (let j = -reach; j <= reach; j += step) {
    for (let i = -reach; i <= reach; i += step) {
      const gray = Math.hypot(i, j) <= reach && pixelAt(pixels, [x + i, y + j]);
      if (gray) [sum, count] = [sum + rgbToLab(gray)[0], count + 1];
    }
  }
  return count > 0 ? sum / count : null;
}
