// The motion: the emitted equations, integrated while the page is looked at.

const system = globalThis.lagrangeSystem;

/** Nodes, weights of stages and of the error: J. R. Dormand, P. J. Prince, J. Comp. Appl. Math. 6 (1980). */
const NODES = [0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1];
const STAGES = [
  [],
  [1 / 5],
  [3 / 40, 9 / 40],
  [44 / 45, -56 / 15, 32 / 9],
  [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
  [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
  [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
];
const ERROR = [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40];

/** Weights of the last coefficient of the dense output: Hairer, Norsett, Wanner, Solving ODEs I, II.6. */
const DENSE = [
  -12715105075 / 11282082432, 0, 87487479700 / 32700410799, -10690763975 / 1880347072,
  701980252875 / 199316789632, -1453857185 / 822651844, 69997945 / 29380423,
];

const MOST_STEPS = 200000;

/** Steps in which a motion has to come on by a part of its time, or it will not end. */
const [WATCHED, LEAST] = [20000, 1e-4];

/** Events in a part of the motion, beyond which ever shorter bounces end; and such parts in all. */
const [MOST_BOUNCES, PARTS] = [50, 10000];

/** A motion from a start, which grows by calls of advance until its end. */
class Motion {
  /**
   * @param {Float64Array} start state at the time `from`
   * @param {number[]} scales of the numbers of a state, for its errors
   */
  constructor(start, from, until, p, scales, tolerance) {
    Object.assign(this, { from, until, p, scales, tolerance });
    this.times = [from];
    this.segments = [];
    [this.energies, this.traced] = [[], []];
    // Segments at whose end the state jumps.
    this.jumps = new Set();
    this.mode = system.FLIGHT;
    this.bounces = { part: 0, count: 0 };
    const led = system.project ? system.project(from, start, p, this.mode) : Float64Array.from(start);
    this.state = led;
    const begun = system.reset ? system.reset(from, led, p) : { y: led };
    this.goOn(from, begun && system.change ? { ...begun, y: system.change(from, begun.y, p) } : begun);
    this.sample(from);
    this.size = this.firstStep();
  }

  /** Go on from a state in a mode; null if contacts or states of two values leave no motion. */
  goOn(t, begun) {
    this.state = begun?.y ?? this.state;
    this.mode = begun?.mode;
    this.slope = system.rhs(t, this.state, this.p, this.mode);
    this.status = begun?.y && this.slope.every(Number.isFinite) ? 'running' : 'failed';
    if (!system.falls) return;
    this.falling = system.falls(t, this.state, this.p, this.mode);
    this.largest ??= new Float64Array(2 * this.falling.length);
  }

  /** What each event waits for: whether a contact is closed, and the states of two values. */
  values(state) {
    return [...(this.mode ?? []), ...(system.PLACES ?? []).map((place) => state[place])];
  }

  get reached() {
    return this.times[this.times.length - 1];
  }

  /** A step in which the state changes by a hundredth of its scales at most. */
  firstStep() {
    const rate = this.norm(this.slope, this.state);
    const span = this.until - this.from;
    return Math.min(span / 100, rate > 0 ? 0.01 / (rate * this.tolerance) : span / 100);
  }

  /** Largest of the values over what a tolerance allows of each. */
  norm(values, state) {
    let largest = 0;
    for (let i = 0; i < values.length; ++i) {
      const allowed = this.tolerance * (this.scales[i] + Math.abs(state[i]));
      largest = Math.max(largest, Math.abs(values[i]) / allowed);
      if (Number.isNaN(values[i])) return NaN;
    }
    return largest;
  }

  /** Integrate for some milliseconds, or until the end; a step that has begun is ended. */
  advance(milliseconds) {
    const end = performance.now() + milliseconds;
    while (this.status === 'running' && performance.now() < end) this.step();
  }

  /** Make one step that the error control accepts. */
  step() {
    const t = this.reached;
    for (;;) {
      const h = Math.min(this.size, this.until - t, this.sampleAt - t);
      const trial = this.trial(t, h);
      const error = this.norm(trial.error, this.state);
      const isAccepted = error <= 1;
      const factor = Number.isFinite(error) ? 0.9 * Math.max(error, 1e-10) ** -0.2 : 0.1;
      this.size = h * Math.min(isAccepted ? 5 : 1, Math.max(0.1, factor));
      if (isAccepted) {
        this.accept(t, h, trial);
        return;
      }
      if (!(t + this.size > t)) {
        this.status = 'failed';
        return;
      }
    }
  }

  /** The stages of a step, its end and the estimate of its error. */
  trial(t, h) {
    const { state, p } = this;
    const k = [this.slope];
    const moved = new Float64Array(state.length);
    for (let s = 1; s < 7; ++s) {
      const change = combined(STAGES[s], k, h);
      for (let i = 0; i < state.length; ++i) moved[i] = state[i] + change[i];
      k.push(system.rhs(t + NODES[s] * h, moved, p, this.mode));
    }
    const error = combined(ERROR, k, h);
    return { k, end: Float64Array.from(moved), error };
  }

  accept(t, h, { k, end }) {
    const { state } = this;
    const change = end.map((value, i) => value - state[i]);
    const begun = change.map((value, i) => h * k[0][i] - value);
    const bent = change.map((value, i) => value - h * k[6][i] - begun[i]);
    const segment = { h, parts: [state, change, begun, bent, combined(DENSE, k, h)] };
    const event = system.falls ? this.firstEvent(t, segment, end) : null;
    this.segments.push(segment);
    if (event) this.cross(event);
    else this.pass(t, h, end, k[6]);
    if (this.reached === this.sampleAt) this.sample(this.sampleAt);
    if (this.status === 'failed') return;
    if (this.reached >= this.until) this.status = 'done';
    else if (this.segments.length >= MOST_STEPS || this.isStuck()) this.status = 'slow';
  }

  /** Say whether the last steps came on by hardly anything. */
  isStuck() {
    const since = this.segments.length - WATCHED;
    return since >= 0 && since % WATCHED === 0
      && this.reached - this.times[since] < LEAST * (this.until - this.from);
  }

  /** End at a time that was passed. */
  endAt(t) {
    const number = this.segmentAt(t);
    this.state = this.at(t);
    this.segments.length = number + 1;
    this.times.length = number + 1;
    this.times.push(t);
    this.traced = [];
    this.status = 'left';
  }

  /**
   * Go on with a known motion where this one has ended: cubics through its coordinates and their
   * rates, straight lines through the other numbers.
   */
  goOnWith(times, columns) {
    const coordinates = columns.length >= 2 * count ? count : 0;
    this.own = this.reached;
    times.forEach((t, k) => {
      if (!(t > this.reached)) return;
      const h = t - this.reached;
      const end = Float64Array.from(columns, (column) => column[k]);
      const { state } = this;
      const change = end.map((value, i) => value - state[i]);
      const bend = (value, i, rate) => (i < coordinates ? h * rate[count + i] - value : 0);
      const begun = change.map((value, i) => bend(value, i, state));
      const bent = change.map((value, i) => -bend(value, i, end) - begun[i]);
      this.segments.push({ h, parts: [state, change, begun, bent, new Float64Array(end.length)] });
      this.times.push(t);
      this.state = end;
    });
  }

  /** Change what controllers hold and remember, if one samples at this time; find the next time. */
  sample(t) {
    this.sampleAt = Infinity;
    if (!data.samplers.length || !this.state) return;
    const laws = system.positions(t, this.state, this.p);
    const y = Float64Array.from(this.state);
    for (const { every, isParameter, changes } of data.samplers) {
      const period = isParameter ? this.p[every] : every;
      const number = Math.round(t / period);
      const isDue = Math.abs(t - number * period) <= 1e-9 * period;
      if (isDue || t === this.from) for (const [k, law] of changes) y[k] = laws[law];
      const next = isDue ? number + 1 : Math.floor(t / period) + 1;
      if (period > 0) this.sampleAt = Math.min(this.sampleAt, next * period);
    }
    this.goOn(t, { mode: this.mode, y });
  }

  /** Go on behind a step without events. */
  pass(t, h, end, slope) {
    // The last time is the end itself, or that of a sample, whatever rounding made of the sum of steps.
    const exact = [this.until, this.sampleAt].find((time) => h === time - t);
    this.times.push(exact ?? t + h);
    this.state = end;
    this.slope = slope;
    if (!system.project) return;
    const led = system.project(t + h, end, this.p, this.mode);
    if (led.every(Number.isFinite)) this.state = led;
    this.slope = system.rhs(t + h, this.state, this.p, this.mode);
  }

  /**
   * The first contact that opens or closes within a step, or state of two values that changes, and
   * when; null if none does.
   */
  firstEvent(t, segment, end) {
    const modes = this.values(this.state);
    const due = (at, y) => {
      const values = system.falls(at, y, this.p, this.mode);
      const event = system.first_due(values.length, modes, this.falling, values, this.largest);
      return { event, values, isDue: event < values.length };
    };
    const last = due(t + segment.h, end);
    if (!last.isDue) {
      this.falling = last.values;
      return null;
    }
    let [early, late, found] = [0, segment.h, last];
    for (let middle = late / 2; early < middle && middle < late; middle = (early + late) / 2) {
      const trial = due(t + middle, dense(segment, middle));
      if (trial.isDue) [late, found] = [middle, trial];
      else early = middle;
    }
    return { event: found.event, t: t + late, y: dense(segment, late) };
  }

  /** Go on behind an event; ever shorter bounces end without restitution. */
  cross({ event, t, y }) {
    this.times.push(t);
    this.jumps.add(this.segments.length - 1);
    const contacts = this.mode?.length ?? 0;
    if (event >= contacts) {
      this.goOn(t, { mode: this.mode, y: system.change(t, y, this.p, event - contacts) });
      return;
    }
    const part = Math.floor(((t - this.from) / (this.until - this.from)) * PARTS);
    this.bounces = { part, count: part === this.bounces.part ? this.bounces.count + 1 : 1 };
    const bounce = this.bounces.count < MOST_BOUNCES ? 1 : 0;
    this.goOn(t, system.reset(t, y, this.p, this.mode, event, bounce));
  }

  /** The state at a time, by the dense output of its step; times beyond the ends are the ends'. */
  at(t) {
    if (!this.segments.length) return this.state;
    const number = this.segmentAt(t);
    return dense(this.segments[number], t - this.times[number]);
  }

  /** One number of the state at a time. */
  numberAt(t, i) {
    if (!this.segments.length) return this.state[i];
    const number = this.segmentAt(t);
    return denseNumber(this.segments[number], t - this.times[number], i);
  }

  segmentAt(t) {
    let low = 0;
    let high = this.segments.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= t) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** The energy at the beginning of a segment, computed once. */
  energyOf(number) {
    const [y] = this.segments[number].parts;
    this.energies[number] ??= system.energy(this.times[number], y, this.p);
    return this.energies[number];
  }

  /** The energy at the end of a segment, before the state jumps there. */
  energyBefore(number) {
    const [begin, end] = this.times.slice(number, number + 2);
    return system.energy(end, dense(this.segments[number], end - begin), this.p);
  }
}

/** The state a time behind the beginning of a segment. */
function dense(segment, time) {
  const state = new Float64Array(segment.parts[0].length);
  for (let i = 0; i < state.length; ++i) state[i] = denseNumber(segment, time, i);
  return state;
}

function denseNumber({ h, parts }, time, i) {
  const s = Math.min(1, Math.max(0, time / h));
  const r = 1 - s;
  return parts[0][i] + s * (parts[1][i] + r * (parts[2][i] + s * (parts[3][i] + r * parts[4][i])));
}

function combined(weights, k, h) {
  const sum = new Float64Array(k[0].length);
  for (let s = 0; s < weights.length; ++s) {
    const [weight, slope] = [h * weights[s], k[s]];
    for (let i = 0; weight && i < sum.length; ++i) sum[i] += weight * slope[i];
  }
  return sum;
}

/** Largest difference of two states over the scales. */
function difference(a, b, scales) {
  return a.reduce((largest, value, i) => Math.max(largest, Math.abs(value - b[i]) / scales[i]), 0);
}
