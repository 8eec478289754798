// Makes a scene on a page of `gs-chroma studio`, in headless Chromium, and opens it there.
//
//   node studio.mjs URL INPUT TEACHER [--out DIR] [--shots] [--paint]
//
// Starts a draft of INPUT, stops and resumes it, waits until it is made, and opens its page. Prints
// one line of JSON: whether the scene was made, milliseconds, cameras of its page, and errors;
// status 1 where there are any.
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { parseArgs } from "node:util";
import { finish, launch } from "./browser.mjs";

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: { out: { type: "string", default: "." }, shots: { type: "boolean", default: false }, paint: { type: "boolean", default: false } },
});
const [url, input, teacher] = positionals;
const MINUTES = 60000;
const browser = await launch();
const found = { errors: [] };
try {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 } });
  const page = await context.newPage();
  page.on("console", (message) => message.type() === "error" && found.errors.push(message.text()));
  page.on("pageerror", (error) => found.errors.push(String(error)));
  mkdirSync(values.out, { recursive: true });
  const shot = async (of, name) => values.shots && of.screenshot({ path: join(values.out, `${name}.png`) });
  const phase = (wanted) => page.locator(`.job[data-phase="${wanted}"]`).first().waitFor({ timeout: 20 * MINUTES });
  await page.goto(url);
  await shot(page, "empty");
  await page.fill("#input", input);
  await page.press("#input", "Tab");
  await page.fill("#teacher", teacher);
  await page.selectOption("#preset", "draft");
  await page.fill("#options", "--no-eval");
  const begun = Date.now();
  await page.click("button[type=submit]");
  await page.locator(".steps .now", { hasText: "fit" }).waitFor({ timeout: 5 * MINUTES });
  await page.waitForTimeout(2500);
  await shot(page, "going");
  await page.locator(".job button", { hasText: "Stop" }).click();
  await phase("stopped");
  await page.locator(".run button", { hasText: "Resume" }).click();
  await phase("done");
  found.made = (await page.locator(".run small", { hasText: "in color" }).count()) > 0;
  found.made_ms = Date.now() - begun;
  await page.locator(".run img").waitFor();
  await page.waitForTimeout(500);
  await shot(page, "made");
  await page.locator(".run button", { hasText: values.paint ? "Paint" : "View" }).first().click();
  const link = page.locator(".job a", { hasText: "Open" });
  await link.waitFor({ timeout: MINUTES });
  const [opened] = await Promise.all([context.waitForEvent("page"), link.click()]);
  await opened.waitForFunction(() => window.gsChroma?.ready);
  await opened.evaluate(() => window.gsChroma.ready);
  found.cameras = await opened.evaluate(() => window.gsChroma.names().length);
  await opened.waitForTimeout(1500);
  await shot(opened, "opened");
  await page.locator(".job button", { hasText: "Close" }).click();
  await phase("stopped");
  await page.setViewportSize({ width: 400, height: 800 });
  await page.waitForTimeout(300);
  await shot(page, "narrow");
} catch (error) {
  found.errors.push(String(error));
} finally {
  await finish(browser, found);
}
