// Paints a list of strokes on a page of `gs-chroma view --paint` at a person's pace, and saves.
//
//   node strokes.mjs URL STROKES.json [--choose MS] [--draw MS] [--out PICTURE.png]
//
// A stroke is { photo, lab, size, points }: the photo's name, the wanted color in CIELAB (without one
// it keeps the teacher's), the brush in pixels of the photo, and places in shares of it. A color that is another than the one before
// is looked at for `choose` milliseconds, a stroke takes `draw`. Prints one line of JSON: strokes
// and clicks, seconds from the first hover to the last stroke, until all has settled, and until it is
// saved, and errors; status 1 where there are any.
import { readFileSync } from "node:fs";
import { parseArgs } from "node:util";
import { finish, launch } from "./browser.mjs";

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: { choose: { type: "string", default: "2000" }, draw: { type: "string", default: "1500" }, out: { type: "string" } },
});
const [url, list] = positionals;
const strokes = JSON.parse(readFileSync(list));
const found = { strokes: strokes.length, clicks: 0, errors: [] };
const browser = await launch();
try {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  page.on("console", (message) => message.type() === "error" && !message.text().includes("404") && found.errors.push(message.text()));
  page.on("pageerror", (error) => found.errors.push(String(error)));
  const said = (text, timeout = 300000) => page.waitForFunction((text) => document.getElementById("status").textContent.includes(text), text, { timeout });
  const click = async (x, y) => {
    await page.mouse.click(x, y);
    found.clicks += 1;
  };
  await page.goto(url);
  await said("Ready");
  const begun = Date.now();
  const since = () => (Date.now() - begun) / 1000;
  let [photo, color] = [null, null];
  for (const stroke of strokes) {
    if (stroke.photo !== photo) {
      await page.locator(`#strip button[title^="${stroke.photo}"]`).click();
      found.clicks += 1;
      await page.waitForFunction((name) => document.getElementById("status").textContent.includes(name), stroke.photo);
      await page.waitForTimeout(500);
      await page.locator("#size").fill(String(stroke.size));
    }
    const place = await page.evaluate(() => window.gsChroma.easel());
    const at = ([x, y]) => [place.x + x * place.width, place.y + y * place.height];
    const points = stroke.points.map(at);
    if (!stroke.lab) {
      await page.keyboard.press("k");
    } else if (String(stroke.lab) !== color) {
      // The wheel takes the lightness that the brush rests over.
      await page.mouse.move(...points[Math.floor(points.length / 2)]);
      await page.waitForTimeout(400);
      const wheel = await page.locator("#wheel").boundingBox();
      const shown = Number((await page.locator("#mixed-text").textContent()).split(" at L ")[1]);
      const [a, b] = stroke.lab.slice(1).map((v) => (v * (shown + 16)) / (stroke.lab[0] + 16));
      await click(wheel.x + (a / 200 + 0.5) * wheel.width, wheel.y + (0.5 - b / 200) * wheel.height);
      await page.waitForTimeout(Number(values.choose) - 400);
    }
    [photo, color] = [stroke.photo, String(stroke.lab)];
    await page.mouse.move(...points[0]);
    await page.mouse.down();
    for (const point of points.slice(1)) {
      await page.mouse.move(...point, { steps: 12 });
      await page.waitForTimeout(Number(values.draw) / (points.length - 1));
    }
    await page.mouse.up();
  }
  found.painted_s = since();
  const version = await page.evaluate(() => window.gsChroma.version());
  await page.waitForFunction((version) => window.gsChroma.version() > version, version, { timeout: 60000 });
  await said("Settled");
  found.settled_s = since();
  if (values.out) {
    await page.waitForTimeout(800);
    await page.screenshot({ path: values.out });
  }
  await page.locator("#save").click();
  found.clicks += 1;
  await said("Saved");
  found.saved_s = since();
} catch (error) {
  found.errors.push(String(error));
} finally {
  await finish(browser, found);
}
