// The motions of the settings, and the loop that draws them.

/** Tolerances: of the page's motion, and how much smaller that of the run it is compared with. */
const [TOLERANCE, FINER] = [1e-11, 100];

/** Difference from the simulated motion over the scales from which on that is shown. */
const LEFT = 1e-3;

/** The shift of a twin's start, and most points of a curve. */
const [SHIFT, MOST_POINTS] = [1e-6, 1500];

/** Units of time in a second: real time, or, of very short and long motions, ten seconds in all. */
function usualSpeed() {
  const seconds = span[1] - span[0];
  return seconds >= 1 && seconds <= 60 ? 1 : seconds / 10;
}

const view = {
  t: span[0], isPlaying: false, speed: usualSpeed(), last: 0, redrawn: 0, marked: 0, drag: null, notice: '',
};

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

// The curves are of other settings, or have grown, since they were drawn; the picture has moved;
// the marks on the curves stand where the picture is.
let [isStale, isGrown, isMoved, isMarked] = [true, true, true, false];

/** Say whether there is a simulated motion of the settings, up to their end. */
const isUsual = () => settings.until <= span[1]
  && settings.p.every((value, k) => value === usual.p[k])
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
  [isStale, isMoved] = [true, true];
  byId('time').min = span[0];
  byId('time').max = settings.until;
}

/** Compare with the simulated motion, or with a finer run, as far as both have come. */
function compare() {
  const other = finer ?? { reached: span[1] };
  const reached = Math.min(motion.own ?? motion.reached, other.reached);
  const times = finer ? evenly(200) : simulatedTimes;
  for (; compared < times.length && times[compared] <= reached; ++compared) {
    const t = times[compared];
    const state = finer ? finer.at(t) : simulatedColumns.map((column) => column[compared]);
    const off = difference(motion.at(t), state, scales);
    if (!finer && off > LEFT && compared) {
      motion.endAt(times[compared - 1]);
      goOnAsSimulated();
      break;
    }
    largest = Math.max(largest, off);
  }
  if (!compared) return;
  const said = (finer ? words.refined : words.certified)
    .replace('{t}', shortly(times[compared - 1])).replace('{size}', shortly(largest, 2));
  byId('difference').textContent = `${words.method} ${said}`;
}

function evenly(parts) {
  return Array.from({ length: parts + 1 }, (_, k) => span[0] + ((settings.until - span[0]) * k) / parts);
}

/**
 * Points of curves: a segment and a time in it, of all segments or of some; the ends of each are
 * among them, so that curves have corners where there are impacts.
 */
function curvePoints() {
  const { segments, times } = motion;
  const every = Math.max(1, Math.ceil(segments.length / MOST_POINTS));
  const parts = Math.max(1, Math.min(60, Math.floor(MOST_POINTS / segments.length)));
  const shownSegments = segments.filter((_, k) => k % every === 0 || k === segments.length - 1);
  return shownSegments.flatMap((segment, place) => {
    const number = Math.min(place * every, segments.length - 1);
    const width = times[number + 1] - times[number];
    return Array.from({ length: parts + 1 }, (_, k) => {
      const time = (width * k) / parts;
      return { t: times[number] + time, of: (i) => denseNumber(segment, time, i) };
    });
  });
}

// -- drawing ------------------------------------------------------------------------------

/** Fit the simulated motion into the drawing, and that of other settings where it is known. */
function fitCamera() {
  if (!stage) return;
  const sampled = simulatedTimes.filter((_, k) => k % Math.ceil(simulatedTimes.length / 60) === 0);
  const simulated = sampled.map((t, k) => {
    const number = simulatedTimes.indexOf(sampled[k]);
    return stage.reach(t, simulatedColumns.map((column) => column[number]), usual.p);
  });
  const ownTimes = motion && !isUsual() ? evenly(60).filter((t) => t <= motion.reached) : [];
  const seen = [...simulated, ...ownTimes.map((t) => stage.reach(t, motion.at(t), settings.p))];
  const atStart = stage.scene(span[0], usual.y, usual.p);
  const round = stage.stage.wheels.flatMap((wheel) => stage.wheel(wheel, atStart)[0]);
  const times = [...seen, [...atStart.places, ...round]].map(
    (places) => places.filter((place) => place.every(Number.isFinite)),
  );
  const known = times.filter((places) => places.length);
  if (known.length) camera.fit(known, painters.drawing.width, painters.drawing.height);
  const start = atStart.places.map((place) => camera.pixel(place));
  stage.turns = data.stage.links.map(({ kind, ends: [a, b] }) => {
    const length = Math.hypot(start[a][0] - start[b][0], start[a][1] - start[b][1]);
    return kind === 'spring' && data.stage.links.length <= 40
      ? Math.min(14, Math.max(3, Math.round(length / 14))) : 0;
  });
  isMoved = true;
}

/** Points of a trace, which is a quarter of the simulated motion long, and most traces. */
const [TRACE_POINTS, MOST_TRACES] = [240, 12];

function drawTraces(painter) {
  if (stage.leading.length > MOST_TRACES) return;
  const apart = (span[1] - span[0]) / (4 * TRACE_POINTS);
  const until = Math.min(view.t, motion.reached);
  const last = Math.floor((until - span[0]) / apart);
  const first = Math.max(0, last - TRACE_POINTS);
  const lines = Array.from({ length: last - first + 1 }, (_, k) => tracedPlaces(first + k, apart));
  lines.push(stage.places(until, motion.at(until), motion.p));
  for (const k of stage.leading) {
    painter.line(lines.map((places) => camera.pixel(places[k])), colours.of('trace'), 1);
  }
}

/** Places of the bodies at one of the times of traces, computed once. */
function tracedPlaces(number, apart) {
  const t = span[0] + number * apart;
  motion.traced[number] ??= stage.places(t, motion.at(t), motion.p);
  return motion.traced[number];
}

function drawAll() {
  const t = Math.min(view.t, motion.reached);
  byId('clock').textContent = `t = ${settings.until < 1e4 && settings.until >= 1 ? t.toFixed(2) : shortly(t)}`;
  byId('time').value = t;
  if (stage) drawSystem(t);
}

function drawSystem(t) {
  const painter = painters.drawing;
  const y = view.drag?.state ?? motion.at(t);
  painter.clear();
  camera.follow(stage.places(t, y, settings.p));
  drawStill(painter, camera, stage, settings.p);
  if (byId('trace').checked) drawTraces(painter);
  if (twin) drawState(painter, camera, stage, { t, y: twin.at(t), p: settings.p }, 'twin', false);
  view.places = drawState(painter, camera, stage, { t, y, p: settings.p }, 'mass', true);
}

/** Draw the curves anew. */
function drawPlots() {
  const points = curvePoints();
  drawSeries(points);
  drawPhase(points);
  drawDrift();
  drawSection();
}

/** Mark the state that is shown on the curves. */
function drawMarks() {
  const t = Math.min(view.t, motion.reached);
  const now = motion.at(t);
  const k = Number(byId('phase-of').value);
  mark(painters.series, shownNumbers().map((number, place) => (
    { colour: COLOURS[place % COLOURS.length], at: [t, now[number]] })));
  mark(painters.phase, [{ colour: COLOURS[1], at: [now[k], now[count + k]] }]);
}

function drawSeries(points) {
  plot(painters.series, shownNumbers().map((k, place) => ({
    colour: COLOURS[place % COLOURS.length],
    points: points.map(({ t, of }) => [t, of(k)]),
  })));
}

function drawPhase(shownPoints) {
  const k = Number(byId('phase-of').value);
  const points = shownPoints.map(({ of }) => [of(k), of(count + k)]);
  plot(painters.phase, [{ colour: COLOURS[0], points }]);
}

function drawDrift() {
  const points = driftPoints();
  plot(painters.drift, [{ colour: COLOURS[3], points }]);
  const worst = points.reduce((most, [, value]) => Math.max(most, Math.abs(value)), 0);
  byId('drift-word').textContent = `${words.drift}: |Δ${data.energy}| ≤ ${shortly(worst, 2)}`;
}

/**
 * Times and changes of the energy, at the ends of steps: between them the dense output is less exact
 * than the steps. Where the state jumps, as at an impact, there is a point before and one behind it.
 */
function driftPoints() {
  const every = Math.max(1, Math.ceil(motion.segments.length / MOST_POINTS));
  const points = motion.segments.flatMap((_, k) => [
    ...(k % every && !motion.jumps.has(k - 1) ? [] : [[motion.times[k], motion.energyOf(k)]]),
    ...(motion.jumps.has(k) ? [[motion.times[k + 1], motion.energyBefore(k)]] : []),
  ]);
  if (points.length) points.push([motion.reached, system.energy(motion.reached, motion.state, motion.p)]);
  return points.map(([t, energy]) => [t, energy - motion.energyOf(0)]);
}

function drawSection() {
  const painter = painters.section;
  byId('section').hidden = !byId('section-on').checked;
  if (byId('section').hidden) return;
  if (!painter.width) painter.resize();
  const crossed = Number(byId('section-of').value);
  const other = count > 1 ? (crossed + 1) % count : crossed;
  const points = passages(motion, crossed, Number(byId('section-at').value), [other, count + other]);
  plot(painter, [{ colour: COLOURS[2], points }], { isDotted: true, empty: words.noPassages });
}

/** Numbers of a state whose curves are drawn: coordinates, then states of first order. */
function shownNumbers() {
  return numbers.map((_, k) => k).filter((k) => k < count || k >= 2 * count).slice(0, COLOURS.length);
}

// -- the loop -----------------------------------------------------------------------------

/** Milliseconds of a frame in which motions are computed while one is shown, and while none is. */
const [SHARED, ALONE] = [6, 12];

/** Milliseconds between two drawings of marks and texts, and of curves that grow. */
const [MARKED, REDRAWN] = [100, 250];

function frame(now) {
  const seconds = Math.min(0.1, (now - view.last) / 1000);
  view.last = now;
  const isGrowing = compute();
  if (view.isPlaying && !view.drag) {
    view.t += seconds * view.speed;
    isMoved = true;
    if (view.t >= settings.until) {
      view.t = settings.until;
      setPlaying(false);
    }
  }
  const wasMoved = isMoved;
  if (isMoved) drawAll();
  isMoved = isGrowing && [motion, twin].some((run) => run && view.t >= run.reached);
  drawBeside(now, isGrowing, wasMoved);
  requestAnimationFrame(frame);
}

/** Compute for a part of a frame; say whether a motion grew. */
function compute() {
  const growing = [motion, twin, finer].filter((run) => run?.status === 'running');
  const share = (view.isPlaying ? SHARED : ALONE) / growing.length;
  for (const run of growing) run.advance(share);
  if (['slow', 'failed'].includes(motion.status) && motion.segments.length) goOnAsSimulated();
  isGrown ||= growing.length > 0;
  return growing.length > 0;
}

/** Go on as it was simulated, where a body sticks or a state is singular, at the scene's settings. */
function goOnAsSimulated() {
  if (!isUsual() || motion.own !== undefined) return;
  motion.goOnWith(simulatedTimes, simulatedColumns);
  [isStale, isMoved] = [true, true];
}

/** Draw curves, marks and texts, a few times a second. */
function drawBeside(now, isGrowing, wasMoved) {
  isMarked &&= !wasMoved;
  const isRedrawn = isStale || (isGrown && (!isGrowing || now - view.redrawn > REDRAWN));
  if (isRedrawn) {
    drawPlots();
    if (isGrown && !isGrowing) fitCamera();
    view.redrawn = now;
    [isStale, isGrown] = [false, isGrowing];
  }
  if (!isRedrawn && (isMarked || now - view.marked < MARKED)) return;
  drawMarks();
  tell();
  view.marked = now;
  isMarked = true;
}

/** Say how far the motion is, and how well it agrees. */
function tell() {
  compare();
  const said = { running: words.computing, failed: words.failed, slow: words.slow, done: '' };
  const isStart = motion.status === 'failed' && !motion.segments.length;
  const ended = isStart ? words.unstarted : said[motion.status];
  const own = motion.own === undefined ? ended : words.recorded.replace('{t}', shortly(motion.own));
  announce([data.undrawn, data.simulated.reason, own, view.notice]);
  byId('apart').hidden = !twin;
  if (!twin) return;
  const t = Math.min(view.t, motion.reached, twin.reached);
  const distance = shortly(difference(motion.at(t), twin.at(t), scales), 2);
  byId('apart').textContent = `${words.apart}: ${distance}`;
}

/** Say what has changed, and nothing where the same is said already: it is read aloud. */
function announce(lines) {
  const text = lines.filter(Boolean).join(' ');
  if (byId('state').textContent !== text) byId('state').textContent = text;
}

function setPlaying(isPlaying) {
  view.isPlaying = isPlaying;
  byId('play').textContent = isPlaying ? words.pause : words.play;
}

/** Begin anew after settings were changed. */
function changed() {
  view.notice = '';
  restart();
  view.t = span[0];
  shown.forEach((show) => show());
  remember();
}

/** Write the settings into the address. */
function remember() {
  history.replaceState(null, '', addressed());
}
