// The data of the page, its settings, the controls that show them, and the address that holds them.

const data = JSON.parse(document.getElementById('data').textContent);
const { words } = data;
const byId = (id) => document.getElementById(id);
const count = data.coordinates.length;

const [simulatedTimes, ...simulatedColumns] = data.simulated.columns;
const span = [simulatedTimes[0], simulatedTimes[simulatedTimes.length - 1]];
const usual = {
  p: [...system.DEFAULTS],
  y: [...system.INITIAL],
  until: span[1],
};
// What jumps, as a state of two values and what is sampled, is compared by what it moves.
const scales = [
  ...[0, 1].flatMap((order) => data.coordinates.map((c) => c.scales[order])),
  ...data.states.map(({ scale, hasTwoValues, isSampled }) => (hasTwoValues || isSampled ? Infinity : scale)),
];

/** Name, symbol and unit of each number of a state: coordinates, velocities, states of first order. */
const numbers = [
  ...data.coordinates,
  ...data.coordinates.map(({ name, symbol, rateUnit }) => ({
    name: `dot(${name})`, symbol, unit: rateUnit, spoken: words.rateOf.replace('{name}', symbol), isRate: true,
  })),
  ...data.states,
];

const settings = { p: [...usual.p], y: [...usual.y], until: usual.until };

/** A symbol as mathematics: its index below it, and a dot above it if it is a rate. */
function mathOf({ symbol, isRate }) {
  const make = (tag, ...inner) => {
    const element = document.createElementNS('http://www.w3.org/1998/Math/MathML', tag);
    element.append(...inner);
    return element;
  };
  const [, letter, ...indices] = /^(.+?)(?:_(\w+)|\[(.+)\]|(\d+))?$/u.exec(symbol);
  const index = indices.find(Boolean);
  let shape = make('mi', letter);
  if (isRate) {
    const accent = make('mo', '˙');
    shape = make('mover', shape, accent);
    shape.setAttribute('accent', 'true');
  }
  if (index) shape = make('msub', shape, make('mi', index));
  return make('math', shape);
}

/** A slider with a number beside it, which changes one value of the settings. */
function slider(parent, given, list, k, [low, high]) {
  const { symbol, spoken, isRate, unit, description, hasTwoValues } = given;
  const row = document.createElement('div');
  row.className = 'slider';
  const [label, range, number, after] = ['label', 'input', 'input', 'span'].map(
    (tag) => row.appendChild(document.createElement(tag)),
  );
  range.id = `${list}-${k}`;
  label.htmlFor = range.id;
  label.append(mathOf({ symbol, isRate }));
  label.title = description ?? '';
  after.textContent = unit ?? '';
  Object.assign(range, { type: 'range', min: low, max: high, step: hasTwoValues ? 1 : 'any' });
  Object.assign(number, { type: 'number', step: 'any' });
  const said = [description, spoken ?? symbol, unit].filter(Boolean).join(', ');
  for (const input of [range, number]) input.setAttribute('aria-label', said);
  const show = () => {
    range.value = settings[list][k];
    number.value = Number(settings[list][k].toPrecision(6));
  };
  const take = (text) => {
    const value = Number(text);
    if (text === '' || !Number.isFinite(value)) return;
    settings[list][k] = hasTwoValues ? Number(value >= 0.5) : value;
    changed();
  };
  range.addEventListener('input', () => take(range.value));
  number.addEventListener('change', () => take(number.value));
  shown.push(show);
  parent.appendChild(row);
}

/** Functions that show the settings in their controls. */
const shown = [];

function rangeOf(value, isPositive) {
  if (value === 0) return isPositive ? [0, 1] : [-1, 1];
  return value > 0 ? [0, 3 * value] : [3 * value, isPositive ? 0 : -3 * value];
}

function startRange({ isAngle, hasTwoValues }, k) {
  const value = usual.y[k];
  if (hasTwoValues) return [0, 1];
  if (isAngle && k < count) return [Math.min(-Math.PI, value), Math.max(Math.PI, value)];
  const reach = 2 * Math.max(Math.abs(value), scales[k]);
  return [-reach, reach];
}

/** The part of the address that holds the settings; the whole path where they are the usual ones. */
function addressed() {
  const parts = [
    ...data.parameters.flatMap(({ name }, k) => differing(`p.${name}`, settings.p[k], usual.p[k])),
    ...numbers.flatMap(({ name }, k) => differing(`y.${name}`, settings.y[k], usual.y[k])),
    ...differing('until', settings.until, usual.until),
  ];
  const all = [...parts, ...CONTROLS.flatMap((id) => differing(id, stateOf(id), usualControls[id]))];
  return all.length ? `#${all.join('&')}` : location.pathname;
}

function differing(name, value, known) {
  return value === known ? [] : [`${encodeURIComponent(name)}=${value}`];
}

/** Controls that the address holds beside parameters and starts, and their usual states. */
const CONTROLS = ['speed', 'trace', 'twin', 'phase-of', 'section-on', 'section-of', 'section-at'];
const usualControls = {};

function stateOf(id) {
  const control = byId(id);
  return control.type === 'checkbox' ? Number(control.checked) : Number(control.value);
}

/** Put a control into a state of the address; states that it cannot have leave it as it is. */
function setControl(id, value) {
  const control = byId(id);
  if (control.type === 'checkbox') control.checked = value !== 0;
  else if (!control.options || [...control.options].some((entry) => Number(entry.value) === value)) {
    control.value = value;
  }
}

/** Take the settings that the address holds; names and numbers that it should not are passed over. */
function fromAddress() {
  Object.assign(settings, { p: [...usual.p], y: [...usual.y], until: usual.until });
  for (const id of CONTROLS) setControl(id, usualControls[id]);
  for (const part of location.hash.slice(1).split('&')) {
    const [name, text] = part.split('=').map(decodedText);
    const value = Number(text);
    if (!text || !Number.isFinite(value)) continue;
    if (name === 'until' && value > span[0]) settings.until = value;
    if (CONTROLS.includes(name)) setControl(name, value);
    const p = data.parameters.findIndex((parameter) => name === `p.${parameter.name}`);
    if (p >= 0) settings.p[p] = value;
    const y = numbers.findIndex((number) => name === `y.${number.name}`);
    if (y >= 0) settings.y[y] = numbers[y].hasTwoValues ? Number(value >= 0.5) : value;
  }
}

function decodedText(text) {
  try {
    return decodeURIComponent(text ?? '');
  } catch {
    return '';
  }
}
