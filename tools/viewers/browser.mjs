// Chromium without a graphics card, as all checks here start it.
import { existsSync } from "node:fs";
import { chromium } from "playwright-core";

const FLAGS = [
  "--no-sandbox", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync",
];
const WEBGL = ["--use-gl=angle", "--use-angle=swiftshader", "--force-color-profile=srgb"];
const BROWSERS = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];

/** The browser; it draws by WebGL unless other flags say how. */
export const launch = (graphics = WEBGL) =>
  chromium.launch({ executablePath: process.env.CHROMIUM ?? BROWSERS.find(existsSync), headless: true, args: [...FLAGS, ...graphics] });

/** Closes the browser and prints what was found; status 1 where there are errors. */
export async function finish(browser, found) {
  await browser.close();
  console.log(JSON.stringify(found));
  process.exitCode = found.errors.length > 0 ? 1 : 0;
}
