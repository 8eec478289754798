// The system's Chromium, drawing in software: no GPU, no network, an empty profile.

import { existsSync } from 'node:fs';
import { delimiter, join } from 'node:path';
import { chromium } from 'playwright-core';

const NAMES = ['chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable'];

const FLAGS = [
  '--use-gl=angle',
  '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader',
  '--ignore-gpu-blocklist',
  '--force-color-profile=srgb',
  '--force-device-scale-factor=1',
  '--no-first-run',
  '--disable-quic',
  '--disable-sync',
  '--disable-background-networking',
  '--disable-component-update',
];

/** Chromium as `CHROMIUM` names it or the PATH has it. */
export function findChromium() {
  const folders = (process.env.PATH ?? '').split(delimiter);
  const candidates = [process.env.CHROMIUM, ...NAMES.flatMap((name) => folders.map((folder) => join(folder, name)))];
  return candidates.find((path) => path && existsSync(path));
}

/** A browser in which nothing but `origin` can be reached. */
export async function openBrowser(origin) {
  const executablePath = findChromium();
  if (!executablePath) throw new Error('no Chromium on the PATH; Debian: apt-get install chromium, or let CHROMIUM name it');
  const browser = await chromium.launch({ executablePath, headless: true, args: FLAGS, chromiumSandbox: false });
  const context = await browser.newContext({ deviceScaleFactor: 1 });
  await context.route('**/*', (route) => (route.request().url().startsWith(origin) || route.request().url().startsWith('blob:') || route.request().url().startsWith('data:') ? route.continue() : route.abort()));
  return { browser, context };
}
