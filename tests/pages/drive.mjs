// Opens pages in a browser without a window and prints, for each, a line of JSON on what it did.
//
//   node drive.mjs BROWSER FILE...

import { createRequire } from 'node:module';
import { pathToFileURL } from 'node:url';

const require = createRequire(`${process.cwd()}/`);
const { default: puppeteer } = await import(pathToFileURL(require.resolve('puppeteer-core')));

const [executablePath, ...files] = process.argv.slice(2);
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
  () => globalThis.lagrangePage.state().isFinished, { timeout: 60000, polling: 100 },
);

const state = (page) => page.evaluate(() => globalThis.lagrangePage.state());

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
  await page.setViewport({ width: 1100, height: 1400 });
  await page.goto(pathToFileURL(file).href);
  await finished(page);
  const usual = await state(page);
  const shown = { difference: await text(page, 'difference'), drift: await text(page, 'drift-word') };
  await page.click('#play');
  const frames = await page.evaluate(() => new Promise((done) => {
    const begin = performance.now();
    let count = 0;
    const next = () => {
      ++count;
      if (performance.now() - begin < 1000) requestAnimationFrame(next);
      else done(count / ((performance.now() - begin) / 1000));
    };
    requestAnimationFrame(next);
  }));
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
  return { file, messages, usual, shown, frames, played, canvases, moved, address, foreign };
}

for (const file of files) {
  try {
    console.log(JSON.stringify(await driven(file)));
  } catch (error) {
    console.log(JSON.stringify({ file, failure: String(error) }));
  }
}
await browser.close();
