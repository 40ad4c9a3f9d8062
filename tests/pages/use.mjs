// Uses a page as a person does: by keys, by the mouse, in two tabs, read aloud, on paper.

/** What an assistive program is told of the page's controls: role and name of each. */
async function controls(page) {
  const session = await page.createCDPSession();
  const { nodes } = await session.send('Accessibility.getFullAXTree');
  const roles = ['button', 'slider', 'spinbutton', 'checkbox', 'combobox', 'image'];
  return nodes.filter(({ ignored, role }) => !ignored && roles.includes(role?.value))
    .map(({ role, name, description }) => [role.value, name?.value ?? '', description?.value ?? '']);
}

const state = (page) => page.evaluate(() => globalThis.lagrangePage.state());

const wait = (milliseconds) => new Promise((done) => { setTimeout(done, milliseconds); });

/** Ids of what the key Tab leads to, in its order. */
async function order(page) {
  const ids = [];
  for (let k = 0; k < 60; ++k) {
    await page.keyboard.press('Tab');
    const id = await page.evaluate(() => document.activeElement.id);
    if (ids.includes(id) && id) return ids;
    ids.push(id);
  }
  return ids;
}

/** Times before and after keys on the drawing. */
async function byKeys(page) {
  await page.focus('#drawing');
  const times = { atRest: (await state(page)).t };
  await page.keyboard.press('Space');
  await wait(400);
  await page.keyboard.press('Space');
  times.played = (await state(page)).t;
  await page.keyboard.press('ArrowRight');
  times.stepped = (await state(page)).t;
  await page.keyboard.press('Home');
  times.home = (await state(page)).t;
  return times;
}

/** How often what is read aloud changes while a twin moves. */
async function announcements(page) {
  await page.click('#twin');
  const counted = await page.evaluate(() => new Promise((done) => {
    let count = 0;
    const observer = new MutationObserver((changes) => { count += changes.length; });
    const spoken = document.querySelectorAll('[aria-live="polite"]');
    spoken.forEach((element) => observer.observe(element, { childList: true, characterData: true, subtree: true }));
    document.getElementById('play').click();
    setTimeout(() => { document.getElementById('play').click(); done(count); }, 600);
  }));
  return { counted, apart: await page.$eval('#apart', (element) => element.textContent) };
}

/** Drag a body by some pixels; the start before and after. */
async function byMouse(page, finished) {
  await page.keyboard.press('Home');
  await page.$eval('#drawing', (canvas) => canvas.scrollIntoView());
  const pixel = await page.evaluate(() => {
    const box = document.getElementById('drawing').getBoundingClientRect();
    return globalThis.lagrangePage.pixels().map(([x, y]) => [x + box.left, y + box.top]);
  });
  const before = await state(page);
  const [x, y] = pixel[0];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 15, y + 15, { steps: 5 });
  await page.mouse.up();
  await finished(page);
  return { before: before.y, after: await state(page) };
}

/** The same settings in another tab, by the address alone. */
async function inAnotherTab(browser, page, finished) {
  await page.$eval('#time', (range) => { range.value = range.min; range.dispatchEvent(new Event('input')); });
  const tab = await browser.newPage();
  await tab.goto(page.url());
  await finished(tab);
  const both = [(await state(page)).y, (await state(tab)).y];
  const twins = await Promise.all([page, tab].map((one) => one.$eval('#twin', (box) => box.checked)));
  await tab.close();
  return { both, twins };
}

/** How far bodies are beyond the drawing, in pixels, while a motion of larger parameters is shown. */
async function enlarged(page, finished) {
  await page.evaluate(() => {
    for (const range of document.querySelectorAll('#parameters input[type="range"]')) {
      range.value = range.max;
      range.dispatchEvent(new Event('input'));
    }
  });
  await finished(page);
  return page.evaluate(async () => {
    const time = document.getElementById('time');
    const { clientWidth: width, clientHeight: height } = document.getElementById('drawing');
    let beyond = -Infinity;
    for (let k = 0; k <= 10; ++k) {
      time.value = (k / 10) * Number(time.max);
      time.dispatchEvent(new Event('input'));
      await new Promise((done) => { setTimeout(done, 50); });
      const pixels = globalThis.lagrangePage.pixels();
      beyond = Math.max(beyond, ...pixels.flatMap(([x, y]) => [-x, -y, x - width, y - height]));
    }
    return beyond;
  });
}

/** What is said of a motion at the scene's own settings that lasts longer than the simulated one. */
async function lengthened(page, finished) {
  await page.click('#reset');
  await page.$eval('#until', (until) => {
    until.value = 2 * Number(until.value);
    until.dispatchEvent(new Event('change'));
  });
  await finished(page);
  return page.$eval('#difference', (element) => element.textContent);
}

/** Shapes of canvases on paper and in their memory, and what is left out. */
async function onPaper(page) {
  await page.emulateMediaType('print');
  const shown = await page.evaluate(() => ({
    shapes: [...document.querySelectorAll('canvas')].filter((canvas) => canvas.clientWidth).map(
      (canvas) => [canvas.clientWidth / canvas.clientHeight, canvas.width / canvas.height],
    ),
    ranges: [...document.querySelectorAll('input[type="range"]')].filter((range) => range.clientWidth).length,
    numbers: [...document.querySelectorAll('#settings input[type="number"]')].filter((input) => input.clientWidth).length,
  }));
  const pages = (await page.pdf({ format: 'A4' })).length;
  await page.emulateMediaType(null);
  return { ...shown, pages };
}

/** What a person finds on a page that is open and at rest. */
export async function used(browser, page, finished) {
  await page.emulateMediaFeatures([{ name: 'prefers-reduced-motion', value: 'reduce' }]);
  const read = await controls(page);
  const tabs = await order(page);
  const keys = await byKeys(page);
  const spoken = await announcements(page);
  const mouse = await byMouse(page, finished);
  const address = await inAnotherTab(browser, page, finished);
  const paper = await onPaper(page);
  const beyond = await enlarged(page, finished);
  const longer = await lengthened(page, finished);
  return { read, tabs, keys, spoken, mouse, address, paper, beyond, longer };
}
