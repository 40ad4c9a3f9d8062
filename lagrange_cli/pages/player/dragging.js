// A body that is dragged: the configuration in which it is nearest to the pointer.

/**
 * The state in which a body is near a pixel, by damped Gauss-Newton steps of the coordinates, whose
 * scales are given.
 */
function dragged(stage, camera, { t, y, p }, body, pixel, scales) {
  const count = scales.length;
  let state = Float64Array.from(y);
  const miss = (trial) => {
    const at = camera.pixel(stage.places(t, trial, p)[body]);
    return [pixel[0] - at[0], pixel[1] - at[1]];
  };
  for (let round = 0; round < 12; ++round) {
    const off = miss(state);
    const columns = Array.from({ length: count }, (_, i) => slope(miss, state, i, 1e-6 * scales[i], off));
    const step = leastStep(columns, off, scales);
    const trial = state.map((value, i) => (i < count ? value + step[i] : value));
    const led = system.project ? system.project(t, trial, p) : trial;
    if (!led.every(Number.isFinite) || Math.hypot(...miss(led)) >= Math.hypot(...off)) break;
    state = led;
  }
  return state;
}

function slope(miss, state, i, by, off) {
  const moved = Float64Array.from(state);
  moved[i] += by;
  const [x, y] = miss(moved);
  return [(off[0] - x) / by, (off[1] - y) / by];
}

/** The step of least size, over the scales, that takes a body to the pointer to first order. */
function leastStep(columns, off, scales) {
  const weighed = columns.map(([x, y], i) => [x * scales[i], y * scales[i]]);
  let [a, b, d] = [0, 0, 0];
  for (const [x, y] of weighed) [a, b, d] = [a + x * x, b + x * y, d + y * y];
  const damping = 1e-4 * (a + d) + 1e-300;
  [a, d] = [a + damping, d + damping];
  const determinant = a * d - b * b;
  const pull = [(d * off[0] - b * off[1]) / determinant, (a * off[1] - b * off[0]) / determinant];
  return weighed.map(([x, y], i) => scales[i] * (x * pull[0] + y * pull[1]));
}
