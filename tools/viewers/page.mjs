// Opens a page of `gs-chroma view`, or a scene.html, in headless Chromium on software WebGL.
//
//   node page.mjs URL [--reference DIR] [--out DIR] [--turn N] [--shot NAME,WIDTHxHEIGHT[,dark]]...
//
// --reference: pictures of `gs-chroma render --views all`; prints the PSNR of the page's picture
// at every photographed camera. --turn: turns the scene N times and prints milliseconds. --shot:
// saves the page as it looks. --do: runs a script in the page before that. --assets: takes the
// page's script and style from assets/viewer instead of the program, to try them without a build.
// Prints one line of JSON; status 1 where the page failed.
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join, parse } from "node:path";
import { parseArgs } from "node:util";
import { finish, launch } from "./browser.mjs";

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    reference: { type: "string" },
    out: { type: "string" },
    turn: { type: "string" },
    shot: { type: "string", multiple: true, default: [] },
    do: { type: "string" },
    assets: { type: "string" },
  },
});
const [url] = positionals;
const browser = await launch();

// In the page: the PSNR of two pictures in dB, alike where their 8-bit values are.
async function compare([ours, theirs]) {
  const pixels = async (url) => {
    const image = new Image();
    image.src = url;
    await image.decode();
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    return context.getImageData(0, 0, image.width, image.height);
  };
  const [a, b] = [await pixels(ours), await pixels(theirs)];
  if (a.width !== b.width || a.height !== b.height) return null;
  let squares = 0;
  for (let k = 0; k < a.data.length; k++) squares += (a.data[k] - b.data[k]) ** 2;
  // Alpha is the same everywhere.
  return -10 * Math.log10(Math.max(squares / (0.75 * a.data.length), 1e-6) / 255 ** 2);
}

const found = { errors: [] };
try {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  page.on("console", (message) => message.type() === "error" && found.errors.push(message.text()));
  page.on("pageerror", (error) => found.errors.push(String(error)));
  if (values.assets) {
    const read = (name) => readFileSync(join(values.assets, name), "utf8");
    const modules = ["scene", "sorter", "shaders", "camera", "controls", "compare", "panel", "renderer", "source", "main"];
    const script = modules.map((name) => read(`${name}.js`)).join("\n").replace(/^import .*$/gm, "").replace(/^export /gm, "");
    await page.route("**/viewer.js", (route) => route.fulfill({ contentType: "text/javascript", body: script }));
    await page.route("**/viewer.css", (route) => route.fulfill({ contentType: "text/css", body: read("style.css") }));
    await page.route(url, (route) => route.fulfill({ contentType: "text/html", body: read("index.html") }));
  }
  const begun = Date.now();
  await page.goto(url);
  await page.evaluate(() => window.gsChroma.ready);
  found.ready_ms = Date.now() - begun;
  if (values.out) mkdirSync(values.out, { recursive: true });
  if (values.reference) {
    const names = await page.evaluate(() => window.gsChroma.names());
    found.psnr = {};
    for (const [k, name] of names.entries()) {
      const { dir, name: stem } = parse(name);
      const file = join(values.reference, dir, `${stem}.png`);
      if (!existsSync(file)) continue;
      const ours = await page.evaluate((k) => window.gsChroma.picture(k), k);
      const theirs = `data:image/png;base64,${readFileSync(file).toString("base64")}`;
      found.psnr[name] = await page.evaluate(compare, [ours, theirs]);
      if (values.out) writeFileSync(join(values.out, `${stem}.png`), Buffer.from(ours.split(",")[1], "base64"));
    }
  }
  if (values.turn) {
    found.turn_ms = [];
    for (let k = 0; k < Number(values.turn); k++) {
      found.turn_ms.push(Math.round(await page.evaluate(() => window.gsChroma.turn(0.1, 0.02))));
    }
  }
  for (const shot of values.shot) {
    const [name, size, scheme] = shot.split(",");
    const [width, height] = size.split("x").map(Number);
    await page.emulateMedia({ colorScheme: scheme ?? "light" });
    await page.setViewportSize({ width, height });
    if (values.do) await page.evaluate(values.do);
    await page.waitForTimeout(1500);
    await page.screenshot({ path: join(values.out ?? ".", `${name}.png`) });
  }
} catch (error) {
  found.errors.push(String(error));
} finally {
  await finish(browser, found);
}
