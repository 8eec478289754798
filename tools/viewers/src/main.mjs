// Draws splat files in viewers, at COLMAP's cameras, and compares with pictures that
// `gs-chroma render` drew there. See README.md.

import { mkdirSync, readdirSync, writeFileSync } from 'node:fs';
import { basename, extname, join, resolve } from 'node:path';
import { parseArgs } from 'node:util';
import { openBrowser } from './browser.mjs';
import { readColmap, resized } from './colmap.mjs';
import { brightness, decodePng, median, psnr, readPng } from './picture.mjs';
import { serve } from './server.mjs';

const VIEWERS = ['spark', 'spark-ext', 'playcanvas', 'three'];

// How long a file may take to open or a view to be drawn, in ms: in software a million
// Gaussians take the better part of a minute.
const PATIENCE = 120_000;

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
// Half a turn about z: from y up to COLMAP's y down.
const HALF_TURN = [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

const USAGE = `usage: node src/main.mjs --colmap FOLDER --reference FOLDER [--out FOLDER]
  [--viewers ${VIEWERS.join(',')}] [--y-up EXTENSIONS] FILE[:VIEWER,…]…`;

async function main() {
  const { values, positionals } = parseArgs({
    allowPositionals: true,
    options: {
      colmap: { type: 'string' },
      reference: { type: 'string' },
      out: { type: 'string', default: 'shots' },
      viewers: { type: 'string', default: VIEWERS.join(',') },
      'y-up': { type: 'string', default: '' },
    },
  });
  if (!values.colmap || !values.reference || positionals.length === 0) throw new Error(USAGE);
  const pictures = readdirSync(values.reference).filter((name) => name.endsWith('.png')).sort();
  const views = readColmap(values.colmap);
  const references = pictures.map((name) => {
    const picture = readPng(join(values.reference, name));
    const view = views.get(name.slice(0, -4));
    if (!view) throw new Error(`${values.colmap}: no photo belongs to ${name}`);
    return { name, picture, view: resized(view, picture.width, picture.height) };
  });
  if (references.length === 0) throw new Error(`${values.reference}: no PNG in it`);
  const yUp = values['y-up'].split(',').filter(Boolean);
  const jobs = positionals.flatMap((argument) => {
    const [, file, chosen] = /^(.*?)(?::([a-z,-]+))?$/.exec(argument);
    return (chosen ?? values.viewers).split(',').map((viewer) => ({ file: resolve(file), viewer }));
  });
  const unknown = jobs.find(({ viewer }) => !VIEWERS.includes(viewer));
  if (unknown) throw new Error(`no viewer ${unknown.viewer}; there are ${VIEWERS.join(', ')}`);
  mkdirSync(values.out, { recursive: true });
  const server = await serve();
  const { browser, context } = await openBrowser(server.origin);
  const results = [];
  try {
    for (const { file, viewer } of jobs) {
      const matrix = yUp.includes(extname(file).slice(1)) ? HALF_TURN : IDENTITY;
      const result = { file: basename(file), viewer, ...await draw(context, server, { file, viewer, matrix, references, out: values.out }) };
      results.push(result);
      console.log(line(result));
    }
  } finally {
    await browser.close();
    server.close();
  }
  writeFileSync(join(values.out, 'results.json'), `${JSON.stringify(results, null, 2)}\n`);
}

/** Opens a file in a viewer and draws all views; what goes wrong is a result too. */
async function draw(context, server, { file, viewer, matrix, references, out }) {
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE);
  const said = [];
  page.on('console', (message) => { if (message.type() === 'error') said.push(message.text()); });
  page.on('pageerror', (error) => said.push(error.message));
  const began = Date.now();
  try {
    const { width, height } = references[0].view;
    await page.setViewportSize({ width, height });
    await page.goto(`${server.origin}/pages/viewer.html?viewer=${viewer}`);
    await page.waitForFunction(() => window.ready);
    await within(page.evaluate(([url, size, placing]) => window.openFile(url, size, placing), [server.share(file), [width, height], matrix]), said);
    const shown = [];
    for (const { name, picture, view } of references) {
      if (view.width !== width || view.height !== height) continue;
      await within(page.evaluate((at) => window.draw(at), view), said);
      const bytes = await page.screenshot();
      writeFileSync(join(out, `${basename(file)}.${viewer}.${name}`), bytes);
      const drawn = decodePng(bytes);
      shown.push({ name, psnr: round(psnr(drawn, picture), 2), brighter: round(brightness(drawn) - brightness(picture), 4) });
    }
    return { views: shown, psnr: round(median(shown.map((view) => view.psnr)), 2), seconds: round((Date.now() - began) / 1000, 1) };
  } catch (error) {
    return { error: [error.message.split('\n')[0], ...said].join('; ').slice(0, 400) };
  } finally {
    await page.close();
  }
}

/** The promise, unless it takes too long. */
function within(promise, said) {
  let timer;
  const late = new Promise((_, reject) => {
    timer = setTimeout(() => reject(new Error(`not done after ${PATIENCE / 1000} s ${said.join('; ')}`)), PATIENCE);
  });
  return Promise.race([promise, late]).finally(() => clearTimeout(timer));
}

function round(value, digits) {
  return Number(value.toFixed(digits));
}

function line({ file, viewer, views, psnr: middle, error, seconds }) {
  if (error) return `${file} in ${viewer}: ${error}`;
  const each = views.map((view) => `${view.psnr} (${view.brighter >= 0 ? '+' : ''}${view.brighter})`).join(', ');
  return `${file} in ${viewer}: ${middle} dB; ${each}; ${seconds} s`;
}

main().catch((error) => {
  console.error(`error: ${error.message}`);
  process.exitCode = 1;
});
