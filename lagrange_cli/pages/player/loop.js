// The motions of the settings, and the loop that draws them.

/** Tolerances: of the page's motion, and how much smaller that of the run it is compared with. */
const [TOLERANCE, FINER] = [1e-11, 100];

/** The shift of a twin's start, and most points of a curve. */
const [SHIFT, MOST_POINTS] = [1e-6, 1500];

/** Units of time in a second: real time, or, of very short and long motions, ten seconds in all. */
function usualSpeed() {
  const seconds = span[1] - span[0];
  return seconds >= 1 && seconds <= 60 ? 1 : seconds / 10;
}

const view = { t: span[0], isPlaying: false, speed: usualSpeed(), last: 0, drag: null };

// A scene that says of nothing where it is has plots, and no drawing.
const stage = data.stage && new Stage(data.stage, usual.p);
const camera = stage && new Camera(data.stage.view);
const painters = Object.fromEntries(
  ['drawing', 'series', 'phase', 'drift', 'section'].map((id) => [id, new Painter(byId(id))]),
);

let motion;
let twin = null;
let finer = null;
let largest = 0;
let compared = 0;
let isStale = true;

const isUsual = () => settings.p.every((value, k) => value === usual.p[k])
  && settings.y.every((value, k) => value === usual.y[k]);

function begun(start, tolerance) {
  return new Motion(Float64Array.from(start), span[0], settings.until, settings.p, scales, tolerance);
}

/** Begin anew with the settings as they are. */
function restart() {
  motion = begun(settings.y, TOLERANCE);
  const beside = settings.y.map((value, k) => (k ? value : value + SHIFT * scales[0]));
  twin = byId('twin').checked ? begun(beside, TOLERANCE) : null;
  finer = isUsual() ? null : begun(settings.y, TOLERANCE / FINER);
  [largest, compared] = [0, 0];
  view.t = Math.min(view.t, settings.until);
  isStale = true;
  byId('time').min = span[0];
  byId('time').max = settings.until;
}

/** Compare with the simulated motion, or with a finer run, as far as both have come. */
function compare() {
  const other = finer ?? { reached: span[1] };
  const reached = Math.min(motion.reached, other.reached);
  const times = finer ? evenly(200) : simulatedTimes;
  for (; compared < times.length && times[compared] <= reached; ++compared) {
    const t = times[compared];
    const state = finer ? finer.at(t) : simulatedColumns.map((column) => column[compared]);
    largest = Math.max(largest, difference(motion.at(t), state, scales));
  }
  if (!compared) return;
  const said = (finer ? words.refined : words.certified)
    .replace('{t}', shortly(times[compared - 1])).replace('{size}', shortly(largest, 2));
  byId('difference').textContent = `${words.method} ${said}`;
}

function evenly(parts) {
  return Array.from({ length: parts + 1 }, (_, k) => span[0] + ((settings.until - span[0]) * k) / parts);
}

/** Times up to the end of what is computed, for curves. */
function curveTimes() {
  const end = motion.reached;
  const parts = Math.min(MOST_POINTS, Math.max(50, 4 * motion.segments.length));
  return Array.from({ length: parts + 1 }, (_, k) => span[0] + ((end - span[0]) * k) / parts);
}

// -- drawing ------------------------------------------------------------------------------

function fitCamera() {
  if (!stage) return;
  const sampled = simulatedTimes.filter((_, k) => k % Math.ceil(simulatedTimes.length / 60) === 0);
  const seen = sampled.flatMap((t, k) => {
    const number = simulatedTimes.indexOf(sampled[k]);
    return stage.reach(t, simulatedColumns.map((column) => column[number]), usual.p);
  });
  const round = stage.stage.wheels.flatMap((wheel) => {
    const places = stage.places(span[0], usual.y, usual.p);
    return stage.wheel(wheel, places, span[0], usual.y, usual.p)[0];
  });
  const places = [...seen, ...round].filter((place) => place.every(Number.isFinite));
  camera.fit(places, painters.drawing.width, painters.drawing.height);
  const start = stage.places(span[0], usual.y, usual.p).map((place) => camera.pixel(place));
  stage.turns = data.stage.links.map(({ kind, ends: [a, b] }) => {
    const length = Math.hypot(start[a][0] - start[b][0], start[a][1] - start[b][1]);
    return kind === 'spring' && data.stage.links.length <= 40
      ? Math.min(14, Math.max(3, Math.round(length / 14))) : 0;
  });
}

function drawTraces(painter) {
  const until = Math.min(view.t, motion.reached);
  const from = Math.max(span[0], until - (span[1] - span[0]) / 4);
  const times = Array.from({ length: 241 }, (_, k) => from + ((until - from) * k) / 240);
  const masses = data.stage.bodies.flatMap(({ kind }, k) => (kind === 'mass' ? [k] : []));
  if (masses.length > 12 || until <= from) return;
  const lines = times.map((t) => stage.places(t, motion.at(t), settings.p));
  for (const k of masses) {
    painter.line(lines.map((places) => camera.pixel(places[k])), painter.colour('trace'), 1);
  }
}

function drawAll() {
  const t = Math.min(view.t, motion.reached);
  byId('clock').textContent = `t = ${settings.until < 1e4 && settings.until >= 1 ? t.toFixed(2) : shortly(t)}`;
  byId('time').value = t;
  if (stage) drawSystem(t);
}

function drawSystem(t) {
  const painter = painters.drawing;
  painter.clear();
  drawStill(painter, camera, stage, settings.p);
  if (byId('trace').checked) drawTraces(painter);
  if (twin) drawState(painter, camera, stage, { t, y: twin.at(t), p: settings.p }, 'twin', false);
  const y = view.drag?.state ?? motion.at(t);
  view.places = drawState(painter, camera, stage, { t, y, p: settings.p }, 'mass', true);
}

function drawPlots() {
  const times = curveTimes();
  const states = times.map((t) => motion.at(t));
  const t = Math.min(view.t, motion.reached);
  const now = motion.at(t);
  drawSeries(times, states, t, now);
  drawPhase(states, now);
  drawDrift();
  drawSection();
}

function drawSeries(times, states, t, now) {
  const curves = [];
  const marks = [];
  shownNumbers().forEach((k, place) => {
    const colour = COLOURS[place % COLOURS.length];
    curves.push({ colour, points: states.map((y, j) => [times[j], y[k]]) });
    marks.push({ colour, at: [t, now[k]] });
  });
  plot(painters.series, curves, { marks });
}

function drawPhase(states, now) {
  const k = Number(byId('phase-of').value);
  const curve = { colour: COLOURS[0], points: states.map((y) => [y[k], y[count + k]]) };
  plot(painters.phase, [curve], { marks: [{ colour: COLOURS[1], at: [now[k], now[count + k]] }] });
}

function drawDrift() {
  // At the ends of steps: between them the dense output is less exact than the steps.
  const every = Math.max(1, Math.ceil(motion.segments.length / MOST_POINTS));
  const ends = motion.segments.flatMap(({ parts: [y] }, k) => (k % every ? [] : [[motion.times[k], y]]));
  const energies = ends.map(([t, y]) => system.energy(t, y, settings.p));
  const points = energies.map((value, k) => [ends[k][0], value - energies[0]]);
  plot(painters.drift, [{ colour: COLOURS[3], points }]);
  const worst = points.reduce((most, [, value]) => Math.max(most, Math.abs(value)), 0);
  byId('drift-word').textContent = `${words.drift}: |Δ${data.energy}| ≤ ${shortly(worst, 2)}`;
}

function drawSection() {
  const painter = painters.section;
  byId('section').hidden = !byId('section-on').checked;
  if (byId('section').hidden) return;
  if (!painter.width) painter.resize();
  const crossed = Number(byId('section-of').value);
  const other = count > 1 ? (crossed + 1) % count : crossed;
  const points = passages(motion, crossed, Number(byId('section-at').value), [other, count + other]);
  plot(painter, [{ colour: COLOURS[2], points }], { isDotted: true });
}

/** Numbers of a state whose curves are drawn: coordinates, then states of first order. */
function shownNumbers() {
  return numbers.map((_, k) => k).filter((k) => k < count || k >= 2 * count).slice(0, COLOURS.length);
}

// -- the loop -----------------------------------------------------------------------------

function frame(now) {
  const seconds = Math.min(0.1, (now - view.last) / 1000);
  view.last = now;
  for (const run of [motion, twin, finer]) run?.advance(run === finer ? 2 : 5);
  if (view.isPlaying && !view.drag) {
    view.t += seconds * view.speed;
    if (view.t >= settings.until) {
      view.t = settings.until;
      setPlaying(false);
    }
  }
  drawAll();
  if (isStale || view.isPlaying) {
    if (isStale || ++view.frames % 6 === 0) drawPlots();
    isStale = [motion, finer].some((run) => run?.status === 'running');
    tell();
  }
  requestAnimationFrame(frame);
}

/** Say how far the motion is, and how well it agrees. */
function tell() {
  compare();
  const said = { running: words.computing, failed: words.failed, slow: words.slow, done: '' };
  const lines = [data.undrawn, data.simulated.reason, said[motion.status]];
  if (twin) {
    const t = Math.min(view.t, motion.reached, twin.reached);
    lines.push(`${words.apart}: ${shortly(difference(motion.at(t), twin.at(t), scales), 2)}`);
  }
  byId('state').textContent = lines.filter(Boolean).join(' ');
}

function setPlaying(isPlaying) {
  view.isPlaying = isPlaying;
  byId('play').textContent = isPlaying ? words.pause : words.play;
  isStale = true;
}

/** Begin anew after settings were changed. */
function changed() {
  restart();
  view.t = span[0];
  shown.forEach((show) => show());
  history.replaceState(null, '', addressed());
}
