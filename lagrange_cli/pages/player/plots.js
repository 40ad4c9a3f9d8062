// Plots beside the drawing: curves over the time, a phase portrait, a section, the energy.

const COLOURS = ['#1f77b4', '#d62728', '#2ca02c', '#9467bd', '#ff7f0e', '#17becf'];

/** A number in few digits, as a person writes it. */
function shortly(value, digits = 4) {
  const isUsual = value === 0 || (Math.abs(value) >= 1e-3 && Math.abs(value) < 1e5);
  if (isUsual) return String(Number(value.toPrecision(digits))).replace('-', '−');
  const [mantissa, exponent] = value.toExponential(digits - 1).split('e');
  const power = String(Number(exponent)).replace(/./g, (sign) => SUPERSCRIPTS[sign]);
  return `${Number(mantissa)}·10${power}`.replace('-', '−');
}

const SUPERSCRIPTS = Object.fromEntries([...'-0123456789'].map((sign, k) => [sign, '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'[k]]));

/** Draw curves of points into a painter, with a frame and the ranges of both axes, or say why not. */
function plot(painter, curves, { isDotted = false, empty = '' } = {}) {
  painter.clear();
  const points = curves.flatMap((curve) => curve.points).filter(isFinitePoint);
  painter.place = points.length ? placed(painter, points) : null;
  if (points.length) drawCurves(painter, curves, isDotted);
  else painter.text(empty, [painter.width / 2, painter.height / 2], colours.of('ink'), 'center');
  painter.keep();
}

/** Draw the curves of the last plot again, and marks on them. */
function mark(painter, marks) {
  if (!painter.place) return;
  painter.recall();
  for (const { at, colour } of marks) {
    if (isFinitePoint(at)) painter.disk(painter.place(at), 4, colour);
  }
}

const isFinitePoint = ([x, y]) => Number.isFinite(x) && Number.isFinite(y);

/** The function from points to pixels by which all points are within the frame, with its ranges. */
function placed(painter, points) {
  const low = [0, 1].map((k) => points.reduce((least, q) => Math.min(least, q[k]), Infinity));
  const high = [0, 1].map((k) => points.reduce((most, q) => Math.max(most, q[k]), -Infinity));
  const spread = [0, 1].map((k) => high[k] - low[k] || Math.abs(high[k]) || 1);
  const frame = [84, 10, painter.width - 10, painter.height - 24];
  const [left, top, right, bottom] = frame;
  const place = ([x, y]) => [
    left + ((x - low[0]) / spread[0]) * (right - left),
    bottom - ((y - low[1]) / spread[1]) * (bottom - top),
  ];
  return Object.assign(place, { frame, low, high });
}

function drawCurves(painter, curves, isDotted) {
  const [ink, faint] = [colours.of('ink'), colours.of('faint')];
  const { frame: [left, top, right, bottom], low, high } = painter.place;
  painter.line([[left, top], [left, bottom], [right, bottom]], faint, 1);
  const said = (value, k, digits) => (
    shortly(Math.abs(value) < 1e-9 * (high[k] - low[k]) ? 0 : value, digits));
  painter.text(said(high[1], 1, 3), [left - 5, top + 10], ink, 'right');
  painter.text(said(low[1], 1, 3), [left - 5, bottom], ink, 'right');
  painter.text(said(low[0], 0, 4), [left, bottom + 17], ink);
  painter.text(said(high[0], 0, 4), [right, bottom + 17], ink, 'right');
  for (const { points, colour } of curves) {
    const shown = points.filter(isFinitePoint).map(painter.place);
    if (isDotted) shown.forEach((at) => painter.disk(at, 1.6, colour));
    else painter.line(shown, colour, 1.4);
  }
}

/** Points at which a coordinate passes a value upwards: two numbers of the state at each. */
function passages(motion, coordinate, value, shown) {
  const points = [];
  const { times } = motion;
  const above = (t) => motion.numberAt(t, coordinate) - value;
  for (let k = 1; k < times.length; ++k) {
    let [a, b] = [times[k - 1], times[k]];
    if (!(above(a) < 0 && above(b) >= 0)) continue;
    for (let halving = 0; halving < 50; ++halving) {
      const middle = (a + b) / 2;
      if (above(middle) < 0) a = middle;
      else b = middle;
    }
    const state = motion.at(b);
    points.push(shown.map((number) => state[number]));
  }
  return points;
}
