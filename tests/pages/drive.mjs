// Opens pages in a browser without a window and prints, for each, a line of JSON on what it did.
//
//   node drive.mjs BROWSER MILLISECONDS FILE... [--use FILE...]
//
// Each page plays for so many milliseconds. Pages behind --use are used by keys, mouse and address, too (use.mjs).

import { createRequire } from 'node:module';
import { pathToFileURL } from 'node:url';
import { used } from './use.mjs';

const require = createRequire(`${process.cwd()}/`);
const { default: puppeteer } = await import(pathToFileURL(require.resolve('puppeteer-core')));

const [executablePath, playing, ...files] = process.argv.slice(2).filter((argument) => argument !== '--use');
const isUsed = new Set(process.argv.includes('--use') ? process.argv.slice(process.argv.indexOf('--use')) : []);
const browser = await puppeteer.launch({ executablePath, args: ['--no-sandbox', '--disable-gpu'] });

/** How many of the pixels of a canvas have any colour. */
const painted = (id) => {
  const canvas = document.getElementById(id);
  if (canvas.hidden || !canvas.width) return 0;
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  return data.filter((value, k) => k % 4 === 3 && value > 0).length;
};

const text = (page, id) => page.$eval(`#${id}`, (element) => element.textContent);

/** Wait until the whole motion and its comparison are there. */
const finished = (page) => page.waitForFunction(
  () => globalThis.lagrangePage.state().isFinished, { timeout: 180000, polling: 100 },
);

const state = (page) => page.evaluate(() => globalThis.lagrangePage.state());

/** Note how many milliseconds of each frame the page's own script takes. */
const timed = () => {
  const request = globalThis.requestAnimationFrame.bind(globalThis);
  globalThis.scriptTimes = [];
  globalThis.requestAnimationFrame = (draw) => request((now) => {
    const begin = performance.now();
    draw(now);
    globalThis.scriptTimes.push(performance.now() - begin);
  });
};

/**
 * Frames of some milliseconds: how many a second, the median and 95th percentile of what the page's
 * script takes of each, and the CPU time of each in the thread that also lays out and paints; in
 * milliseconds.
 */
async function frames(page, milliseconds) {
  const session = await page.createCDPSession();
  await session.send('Performance.enable');
  const used = async () => {
    const { metrics } = await session.send('Performance.getMetrics');
    return 1000 * metrics.find(({ name }) => name === 'ThreadTime').value;
  };
  const before = await used();
  const [seconds, times] = await page.evaluate((wait) => new Promise((done) => {
    globalThis.scriptTimes.length = 0;
    const begin = performance.now();
    setTimeout(() => done([(performance.now() - begin) / 1000, globalThis.scriptTimes]), wait);
  }), milliseconds);
  const spent = (await used()) - before;
  times.sort((a, b) => a - b);
  const at = (part) => times[Math.floor(part * times.length)];
  return {
    perSecond: times.length / seconds, script: at(0.5), slow: at(0.95), thread: spent / times.length,
  };
}

/** Move a slider to a part of its range, as a hand would. */
const slide = (page, id, part) => page.$eval(`#${id}`, (range, share) => {
  range.value = Number(range.min) + share * (Number(range.max) - Number(range.min));
  range.dispatchEvent(new Event('input'));
}, part);

async function driven(file) {
  const page = await browser.newPage();
  const messages = [];
  page.on('console', (message) => messages.push(message.text()));
  page.on('pageerror', (error) => messages.push(String(error)));
  page.on('request', (request) => {
    if (!request.url().startsWith('file:')) messages.push(`request: ${request.url()}`);
  });
  await page.evaluateOnNewDocument(timed);
  await page.setViewport({ width: 1100, height: 1400 });
  await page.goto(pathToFileURL(file).href);
  await finished(page);
  const usual = await state(page);
  const use = isUsed.has(file) ? await used(browser, page, finished) : null;
  if (use) return { file, messages, usual, use };
  const shown = { difference: await text(page, 'difference'), drift: await text(page, 'drift-word') };
  const drift = await page.evaluate(() => globalThis.lagrangePage.drift());
  await page.click('#play');
  const shownFrames = await frames(page, Number(playing));
  const played = await state(page);
  const canvases = {};
  for (const id of ['drawing', 'series', 'phase', 'drift']) {
    canvases[id] = await page.evaluate(painted, id);
  }
  let moved = null;
  if (await page.$('#y-0')) {
    await slide(page, 'y-0', 0.55);
    await finished(page);
    moved = { ...(await state(page)), difference: await text(page, 'difference') };
  }
  const address = await page.evaluate(() => location.hash);
  const foreign = await page.evaluate(() => Object.keys(globalThis).filter((name) => name.startsWith('pwned')));
  await page.close();
  return { file, messages, usual, shown, drift, frames: shownFrames, played, canvases, moved, address, foreign };
}

for (const file of files) {
  try {
    console.log(JSON.stringify(await driven(file)));
  } catch (error) {
    console.log(JSON.stringify({ file, failure: String(error) }));
  }
}
await browser.close();
