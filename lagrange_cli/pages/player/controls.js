// Pointer, keys and controls, and the beginning of the page.

function pixelOf(event) {
  const box = painters.drawing.canvas.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
}

function nearestBody(pixel) {
  let best = null;
  stage.leading.forEach((k) => {
    const [x, y] = camera.pixel(view.places[k]);
    const distance = Math.hypot(x - pixel[0], y - pixel[1]);
    if (distance < 18 && distance < (best?.distance ?? Infinity)) {
      best = { body: k, distance };
    }
  });
  return best;
}

function pressed(event) {
  const pixel = pixelOf(event);
  const found = nearestBody(pixel);
  painters.drawing.canvas.setPointerCapture(event.pointerId);
  const t = Math.min(view.t, motion.reached);
  if (!found) {
    view.drag = camera.isFlat ? null : { from: pixel };
    return;
  }
  const state = Float64Array.from(motion.at(t)).fill(0, count, 2 * count);
  view.drag = { body: found.body, state, t };
}

function moved(event) {
  const { drag } = view;
  if (!drag) return;
  isMoved = true;
  const pixel = pixelOf(event);
  if (drag.from) {
    camera.turn((drag.from[0] - pixel[0]) / 120, (pixel[1] - drag.from[1]) / 120);
    drag.from = pixel;
  } else {
    const from = { t: span[0], y: drag.state, p: settings.p };
    drag.state = dragged(stage, camera, from, drag.body, pixel, scales.slice(0, count));
  }
}

function released() {
  const { drag } = view;
  view.drag = null;
  if (!drag?.state) return;
  settings.y = [...drag.state];
  changed();
}

const KEYS = {
  ' ': () => playOrPause(),
  ArrowRight: (isShifted) => (isShifted ? turned(0.1, 0) : stepBy(1)),
  ArrowLeft: (isShifted) => (isShifted ? turned(-0.1, 0) : stepBy(-1)),
  ArrowUp: () => turned(0, 0.1),
  ArrowDown: () => turned(0, -0.1),
  Home: () => goTo(span[0]),
};

/** Turn the view of a system in space. */
function turned(azimuth, elevation) {
  camera.turn(azimuth, elevation);
  isMoved = true;
}

function playOrPause() {
  if (view.t >= settings.until) view.t = span[0];
  setPlaying(!view.isPlaying);
}

function stepBy(frames) {
  setPlaying(false);
  const by = (settings.until - span[0]) / 200;
  goTo(view.t + frames * by);
}

function goTo(t) {
  view.t = Math.max(span[0], Math.min(settings.until, t));
  isMoved = true;
}

// -- the beginning ------------------------------------------------------------------------

function option(select, value, text) {
  const entry = select.appendChild(document.createElement('option'));
  entry.value = value;
  entry.textContent = text;
}

function fill() {
  for (const key of ['speed', 'time', 'until', 'trace', 'twin', 'parameters', 'start', 'series', 'phase', 'section']) {
    byId(`${key}-word`).textContent = words[key];
  }
  for (const key of ['step', 'reset', 'link']) byId(key).textContent = words[key];
  byId('drawing').setAttribute('aria-label', words.drawing);
  byId('keys').textContent = camera && !camera.isFlat ? `${words.keys} ${words.turning}` : words.keys;
  byId('phase-of').setAttribute('aria-label', words.phase);
  byId('section-of').setAttribute('aria-label', `${words.section}, ${words.sectionOf}`);
  byId('section-at').setAttribute('aria-label', words.sectionAt);
  byId('drawing').hidden = !stage;
  for (const key of ['series', 'phase', 'drift', 'section']) byId(key).setAttribute('aria-label', words[key]);
  byId('section-rest').textContent = words.sectionOf;
  const multiples = [0.1, 0.25, 0.5, 1, 2, 4, 10];
  multiples.forEach((part) => option(byId('speed'), part * view.speed, `${shortly(part * view.speed)} ×`));
  byId('speed').value = view.speed;
  data.coordinates.forEach((c, k) => {
    option(byId('phase-of'), k, `${c.symbol}, ${c.rate}`);
    option(byId('section-of'), k, c.symbol);
  });
  byId('phase-of').value = Math.max(0, data.coordinates.findIndex((_, k) => isVaried(count + k)));
  shownNumbers().forEach((k, place) => {
    const mark = byId('shown').appendChild(document.createElement('span'));
    mark.append(mathOf(numbers[k]), ' ');
    mark.style.color = COLOURS[place % COLOURS.length];
  });
  data.parameters.forEach((parameter, k) => {
    if (!parameter.isRead) return;
    slider(byId('parameters'), parameter, 'p', k, rangeOf(usual.p[k], parameter.isPositive));
  });
  numbers.forEach((number, k) => {
    if (!number.isHeld) slider(byId('start'), number, 'y', k, startRange(number, k));
  });
}

/** Say whether a number of the simulated motion has more than one value. */
function isVaried(k) {
  const column = simulatedColumns[k];
  return column.some((value) => Math.abs(value - column[0]) > 1e-9 * scales[k]);
}

function listen() {
  byId('play').addEventListener('click', playOrPause);
  byId('step').addEventListener('click', () => stepBy(1));
  byId('reset').addEventListener('click', () => {
    Object.assign(settings, { p: [...usual.p], y: [...usual.y], until: usual.until });
    byId('until').value = usual.until;
    changed();
  });
  byId('time').addEventListener('input', () => {
    setPlaying(false);
    goTo(Number(byId('time').value));
  });
  byId('speed').addEventListener('change', () => { view.speed = Number(byId('speed').value); });
  byId('until').addEventListener('change', () => {
    const until = Number(byId('until').value);
    if (until > span[0]) settings.until = until;
    changed();
  });
  byId('twin').addEventListener('change', restart);
  byId('link').addEventListener('click', () => {
    navigator.clipboard?.writeText(location.href).catch(() => {});
    view.notice = words.copied;
    isMoved = true;
  });
  for (const id of CONTROLS) byId(id).addEventListener('change', remember);
  window.addEventListener('hashchange', () => {
    fromAddress();
    view.speed = Number(byId('speed').value);
    byId('until').value = settings.until;
    changed();
  });
  byId('trace').addEventListener('change', () => { isMoved = true; });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
    colours.known.clear();
    [isStale, isMoved] = [true, true];
  });
  for (const id of ['phase-of', 'section-on', 'section-of', 'section-at']) {
    byId(id).addEventListener('change', () => { isStale = true; });
  }
  if (stage) listenToDrawing(painters.drawing.canvas);
  window.addEventListener('resize', () => {
    Object.values(painters).forEach((painter) => painter.resize());
    fitCamera();
    [isStale, isMoved] = [true, true];
  });
}

function listenToDrawing(canvas) {
  canvas.addEventListener('pointerdown', pressed);
  canvas.addEventListener('pointermove', moved);
  canvas.addEventListener('pointerup', released);
  canvas.addEventListener('pointercancel', () => { [view.drag, isMoved] = [null, true]; });
  canvas.addEventListener('keydown', (event) => {
    const isVertical = event.key === 'ArrowUp' || event.key === 'ArrowDown';
    const isOther = event.ctrlKey || event.altKey || event.metaKey || (isVertical && !event.shiftKey);
    if (!KEYS[event.key] || isOther) return;
    event.preventDefault();
    KEYS[event.key](event.shiftKey);
  });
}

fill();
for (const id of CONTROLS) usualControls[id] = stateOf(id);
fromAddress();
view.speed = Number(byId('speed').value);
fitCamera();
restart();
shown.forEach((show) => show());
byId('until').value = settings.until;
setPlaying(false);
listen();
requestAnimationFrame(frame);

/** What the page shows, for whoever drives it. */
globalThis.lagrangePage = {
  drift: driftPoints,
  pixels: () => stage.leading.map((k) => camera.pixel(view.places[k])),
  state: () => ({
    t: view.t,
    y: [...motion.at(Math.min(view.t, motion.reached))],
    end: [...motion.state],
    reached: motion.reached,
    status: motion.status,
    steps: motion.segments.length,
    largest,
    isFinished: !isStale && !isGrown && [motion, finer].every((run) => run?.status !== 'running'),
  }),
};
