// Paints on a page of `gs-chroma view --paint` with the mouse, in headless Chromium.
//
//   node paint.mjs URL [--out DIR] [--photo N] [--wheel U,V] [--stroke X,Y,X,Y] [--size N] [--wait S] [--shots]
//
// Draws one stroke, places in shares of the photo, waits until the colors settle, undoes and does it
// again; then draws the same on the scene from a view beside, and undoes that. Prints one line of
// JSON: milliseconds until the page is ready, shows the preview and the settled colors, colors under the stroke,
// what the page says of the stroke on the scene, and errors; status 1 where there are any.
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { parseArgs } from "node:util";
import { finish, launch } from "./browser.mjs";

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    out: { type: "string", default: "." },
    photo: { type: "string", default: "2" },
    wheel: { type: "string", default: "0.72,0.72" },
    stroke: { type: "string", default: "0.59,0.86,0.74,0.86" },
    size: { type: "string", default: "9" },
    wait: { type: "string", default: "120" },
    shots: { type: "boolean", default: false },
  },
});
const numbers = (text) => text.split(",").map(Number);
const browser = await launch();
const found = { errors: [] };
try {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  page.on("console", (message) => message.type() === "error" && !message.text().includes("404") && found.errors.push(message.text()));
  page.on("pageerror", (error) => found.errors.push(String(error)));
  mkdirSync(values.out, { recursive: true });
  const shot = async (name) => values.shots && page.screenshot({ path: join(values.out, `${name}.png`) });
  const said = (text, timeout = 1000 * Number(values.wait)) => page.waitForFunction((text) => document.getElementById("status").textContent.includes(text), text, { timeout });
  const opened = Date.now();
  await page.goto(positionals[0]);
  await page.waitForSelector("#strip button");
  await said("Ready");
  found.ready_ms = Date.now() - opened;
  await page.locator("#strip button").nth(Number(values.photo)).click();
  await page.waitForTimeout(800);
  await shot("ready");

  // Where the photo lies: it is fitted into what nothing lies over.
  const place = await page.evaluate(() => window.gsChroma.easel());
  const at = (x, y) => [place.x + x * place.width, place.y + y * place.height];
  const under = async ([x, y]) => page.evaluate(([x, y]) => [...document.getElementById("easel").getContext("2d").getImageData(x, y, 1, 1).data.slice(0, 3)], [Math.round(x), Math.round(y)]);
  await page.locator("#size").fill(values.size);
  const wheel = await page.locator("#wheel").boundingBox();
  const [u, v] = numbers(values.wheel);
  const [x0, y0, x1, y1] = numbers(values.stroke);
  const [start, end] = [at(x0, y0), at(x1, y1)];
  const middle = at((x0 + x1) / 2, (y0 + y1) / 2 - 0.03);
  await page.mouse.move(...middle);
  await page.mouse.click(wheel.x + u * wheel.width, wheel.y + v * wheel.height);
  await page.mouse.move(...end);
  await page.waitForTimeout(300);
  found.before = await under(middle);
  await page.mouse.move(...start);
  await page.mouse.down();
  await page.mouse.move(...end, { steps: 25 });
  await shot("stroke");
  await page.mouse.up();
  const begun = Date.now();
  await page.mouse.move(...at(0.05, 0.05));
  await page.waitForFunction((before) => window.gsChroma.version() > before, await page.evaluate(() => window.gsChroma.version()), { timeout: 1000 * Number(values.wait), polling: 20 });
  found.previewed_ms = Date.now() - begun;
  await shot("previewed");
  await said("Settled");
  await page.waitForTimeout(600);
  found.settled = await page.locator("#status").textContent();
  found.painted = await under(middle);
  await shot("settled");
  if (values.shots) {
    await page.keyboard.press("2");
    await page.waitForTimeout(500);
    await shot("gray");
    await page.keyboard.press("1");
    await page.keyboard.press("s");
    await page.keyboard.press("d");
    await page.waitForFunction(() => window.gsChroma.doubt() !== null, undefined, { timeout: 60000 });
    await page.waitForTimeout(1500);
    await shot("doubt");
    await page.keyboard.press("d");
    await page.keyboard.press("s");
    await page.keyboard.press("v");
    await page.waitForTimeout(2500);
    await shot("scene");
    await page.keyboard.press("v");
    await page.setViewportSize({ width: 400, height: 800 });
    await page.waitForTimeout(800);
    await shot("narrow");
    await page.setViewportSize({ width: 1280, height: 800 });
    await page.waitForTimeout(500);
  }
  await page.keyboard.press("Control+z");
  await page.waitForFunction(() => document.getElementById("undo").disabled, undefined, { timeout: 1000 * Number(values.wait) });
  await said("Settled");
  await page.waitForTimeout(600);
  found.undone = await under(middle);
  await page.keyboard.press("Control+Shift+Z");
  await page.waitForFunction(() => document.getElementById("redo").disabled, undefined, { timeout: 1000 * Number(values.wait) });
  await said("Settled");

  // The same from a view beside the photo's.
  const strokes = () => page.evaluate(() => fetch("paint/news/0").then((answer) => answer.json()).then(({ undo }) => undo));
  const before = await strokes();
  await page.keyboard.press("v");
  await page.waitForTimeout(1500);
  await page.evaluate(() => window.gsChroma.turn(0.06, 0.03));
  await page.waitForTimeout(500);
  await page.keyboard.press("b");
  const shown = await page.evaluate(() => window.gsChroma.seen());
  const on = (x, y) => [shown.x + x * shown.width, shown.y + y * shown.height];
  await page.mouse.move(...on(x0, y0));
  await page.mouse.down();
  await page.mouse.move(...on(x1, y1), { steps: 25 });
  await shot("scene-stroke");
  const drawn = Date.now();
  await page.mouse.up();
  await said(" photo");
  found.scene_ms = Date.now() - drawn;
  found.scene = await page.locator("#status").textContent();
  await said("Settled");
  await page.waitForTimeout(600);
  await shot("scene-settled");
  found.scene_changes = (await strokes()) - before;
  await page.keyboard.press("Control+z");
  await page.waitForFunction(() => !document.getElementById("redo").disabled);
} catch (error) {
  found.errors.push(String(error));
} finally {
  await finish(browser, found);
}
