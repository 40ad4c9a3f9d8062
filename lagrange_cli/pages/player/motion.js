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
    this.state = system.project ? system.project(from, start, p) : Float64Array.from(start);
    this.slope = system.rhs(from, this.state, p);
    this.status = this.slope.every(Number.isFinite) ? 'running' : 'failed';
    this.size = this.firstStep();
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

  /** Integrate for some milliseconds, or until the end. */
  advance(milliseconds) {
    const end = performance.now() + milliseconds;
    while (this.status === 'running') {
      for (let k = 0; k < 20 && this.status === 'running'; ++k) this.step();
      if (performance.now() > end) break;
    }
  }

  /** Make one step that the error control accepts. */
  step() {
    const t = this.reached;
    for (;;) {
      const h = Math.min(this.size, this.until - t);
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
      for (let i = 0; i < state.length; ++i) {
        let sum = 0;
        for (let r = 0; r < s; ++r) sum += STAGES[s][r] * k[r][i];
        moved[i] = state[i] + h * sum;
      }
      k.push(system.rhs(t + NODES[s] * h, moved, p));
    }
    const error = combined(ERROR, k, h);
    return { k, end: Float64Array.from(moved), error };
  }

  accept(t, h, { k, end }) {
    const { state } = this;
    const last = combined(DENSE, k, h);
    const change = end.map((value, i) => value - state[i]);
    const begun = change.map((value, i) => h * k[0][i] - value);
    const bent = change.map((value, i) => value - h * k[6][i] - begun[i]);
    this.segments.push([state, change, begun, bent, last]);
    // The last time is the end itself, whatever rounding made of the sum of steps.
    this.times.push(h === this.until - t ? this.until : t + h);
    this.state = end;
    this.slope = k[6];
    if (system.project) {
      const led = system.project(t + h, end, this.p);
      if (led.every(Number.isFinite)) this.state = led;
      this.slope = system.rhs(t + h, this.state, this.p);
    }
    if (this.reached >= this.until) this.status = 'done';
    else if (this.segments.length >= MOST_STEPS) this.status = 'slow';
  }

  /** The state at a time, by the dense output of its step; times beyond the ends are the ends'. */
  at(t) {
    if (!this.segments.length) return this.state;
    let low = 0;
    let high = this.segments.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.times[middle] <= t) low = middle;
      else high = middle - 1;
    }
    const h = this.times[low + 1] - this.times[low];
    const s = Math.min(1, Math.max(0, (t - this.times[low]) / h));
    const r = 1 - s;
    const [a, b, c, d, e] = this.segments[low];
    return a.map((value, i) => value + s * (b[i] + r * (c[i] + s * (d[i] + r * e[i]))));
  }
}

function combined(weights, k, h) {
  const sum = new Float64Array(k[0].length);
  weights.forEach((weight, s) => {
    for (let i = 0; weight && i < sum.length; ++i) sum[i] += h * weight * k[s][i];
  });
  return sum;
}

/** Largest difference of two states over the scales. */
function difference(a, b, scales) {
  return a.reduce((largest, value, i) => Math.max(largest, Math.abs(value - b[i]) / scales[i]), 0);
}
