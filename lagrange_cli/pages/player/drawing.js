// The drawing of a state: bodies, links, wheels and curves of the stage.

/** Half the width of springs and the radius of bodies, in pixels. */
const [SPRING, BODY] = [7, 6];

/** Where everything of the stage is at a state. */
class Stage {
  constructor(stage, initial) {
    this.stage = stage;
    this.usual = initial;
    this.radius = stage.bodies.length > 60 ? 3 : BODY;
  }

  /** Places of all bodies, each of three numbers. */
  places(t, y, p) {
    const positions = system.positions(t, y, p);
    const places = this.stage.bodies.map((body) => body.at && located(body.at, y, positions));
    this.stage.bodies.forEach((body, k) => {
      if (!body.about) return;
      const [turned, coordinate] = body.about;
      const across = Float64Array.from(y);
      across[coordinate] += Math.PI;
      const { at } = this.stage.bodies[turned];
      const opposite = located(at, across, system.positions(t, across, p));
      places[k] = places[turned].map((x, i) => (x + opposite[i]) / 2);
    });
    return places;
  }

  /** The vectors that span the outline of a rigid body. */
  spans({ spans }, t, y, p) {
    const positions = system.positions(t, y, p);
    return spans.map((span) => located(span, y, positions));
  }

  /** Places of all bodies, and the ends of what spans their outlines. */
  reach(t, y, p) {
    const places = this.places(t, y, p);
    const ends = this.stage.outlines.flatMap((outline) => this.spans(outline, t, y, p).flatMap(
      (span) => [1, -1].map((sign) => places[outline.body].map((x, i) => x + sign * span[i])),
    ));
    return [...places, ...ends];
  }

  /** Lines of the outline of a rigid body, seen by a camera. */
  outline(outline, places, t, y, p, camera) {
    const centre = places[outline.body];
    const spans = this.spans(outline, t, y, p);
    const at = (factors) => centre.map(
      (x, i) => factors.reduce((sum, factor, k) => sum + factor * spans[k][i], x),
    );
    const lines = outline.lines.map((line) => line.map(at));
    if (outline.shape === 'cylinder') lines.push(...sides(spans, camera).map((side) => side.map(at)));
    return lines;
  }

  /** Curves that are drawn: those whose parameters have the values of the sketch. */
  curves(p) {
    return this.stage.curves.filter(
      ({ parameters }) => parameters && parameters.every((k) => p[k] === this.usual[k]),
    );
  }

  /** The rim of a wheel and its spoke, if its angle is known. */
  wheel(wheel, places, t, y, p) {
    const centre = places[wheel.body];
    const radius = wheel.isParameter ? p[wheel.radius] : wheel.radius;
    const rim = (angle) => centre.map(
      (x, i) => x - radius * (Math.cos(angle) * wheel.normal[i] + Math.sin(angle) * wheel.towards[i]),
    );
    const line = Array.from({ length: 61 }, (_, k) => rim((2 * Math.PI * k) / 60));
    if (!wheel.angle || (wheel.ground && !wheel.isStraight)) return [line];
    const [source, k] = wheel.angle;
    return [line, [centre, rim((source === 'coordinate' ? y : system.positions(t, y, p))[k])]];
  }
}

function located(at, y, positions) {
  return at.map((part) => {
    if (typeof part === 'number') return part;
    return (part[0] === 'coordinate' ? y : positions)[part[1]];
  });
}

/** Factors along the two lines at which a cylinder is seen from the side. */
function sides(spans, camera) {
  const [first, second, along] = spans.map((span) => camera.plane(span));
  const across = [first, second].map((a) => a[0] * along[1] - a[1] * along[0]);
  const turn = Math.atan2(across[1], across[0]);
  return [turn, turn + Math.PI].map(
    (angle) => [1, -1].map((end) => [Math.cos(angle), Math.sin(angle), end]),
  );
}

/** Draws into a canvas. */
class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
    this.resize();
  }

  /** Take the size that the page gives the canvas. */
  resize() {
    const ratio = window.devicePixelRatio || 1;
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    this.canvas.width = Math.round(this.width * ratio);
    this.canvas.height = Math.round(this.height * ratio);
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  clear() {
    this.context.clearRect(0, 0, this.width, this.height);
    const style = getComputedStyle(document.documentElement);
    this.colour = (name) => style.getPropertyValue(`--${name}`).trim();
  }

  line(points, colour, width = 1, dash = []) {
    const { context } = this;
    context.beginPath();
    points.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.lineJoin = 'round';
    context.setLineDash(dash);
    context.stroke();
    context.setLineDash([]);
  }

  circle([x, y], radius, colour, width) {
    const { context } = this;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.stroke();
  }

  disk([x, y], radius, colour) {
    const { context } = this;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = colour;
    context.fill();
  }

  text(words, [x, y], colour, align = 'left') {
    const { context } = this;
    context.font = '13px system-ui, sans-serif';
    context.textAlign = align;
    context.fillStyle = colour;
    context.fillText(words, x, y);
  }
}

/** Lines of a link between two pixels. */
function linkLines(kind, [x0, y0], [x1, y1], turns) {
  const length = Math.hypot(x1 - x0, y1 - y0);
  const along = length ? [(x1 - x0) / length, (y1 - y0) / length] : [1, 0];
  const at = (part, side) => [
    x0 + part * (x1 - x0) - side * along[1], y0 + part * (y1 - y0) + side * along[0],
  ];
  if (kind === 'spring' && turns) {
    const zigzag = Array.from({ length: 2 * turns }, (_, k) => at(
      0.12 + (0.76 * (k + 0.5)) / (2 * turns), k % 2 ? -SPRING : SPRING,
    ));
    return [[at(0, 0), at(0.12, 0), ...zigzag, at(0.88, 0), at(1, 0)]];
  }
  if (kind === 'damper' && length > 4 * SPRING) {
    return [
      [at(0, 0), at(0.35, 0)],
      [at(0.65, SPRING), at(0.35, SPRING), at(0.35, -SPRING), at(0.65, -SPRING)],
      [at(0.55, 0.7 * SPRING), at(0.55, -0.7 * SPRING)],
      [at(0.55, 0), at(1, 0)],
    ];
  }
  return [[at(0, 0), at(1, 0)]];
}

const WIDTHS = { rod: 2.5, wheel: 1.5, body: 1.2 };

/** Draw what does not move: curves, the ground of wheels, the direction of gravity. */
function drawStill(painter, camera, stage, p) {
  const faint = painter.colour('faint');
  const grounds = stage.stage.wheels.map((wheel) => wheel.ground).filter(Boolean);
  for (const line of [...stage.curves(p).map(({ points }) => points), ...grounds]) {
    painter.line(line.map((place) => camera.pixel(place)), faint, 1.2);
  }
  const { down } = stage.stage;
  if (!down) return;
  const [x, y] = camera.plane(down);
  const size = Math.hypot(x, y);
  if (size < 1e-6) return;
  const tip = [painter.width - 24, 58];
  const along = [x / size, -y / size];
  const shaft = tip.map((value, k) => value - 36 * along[k]);
  const wing = (side) => [
    tip[0] - 8 * along[0] - side * 4 * along[1], tip[1] - 8 * along[1] + side * 4 * along[0],
  ];
  painter.line([shaft, tip], faint, 1.5);
  painter.line([wing(1), tip, wing(-1)], faint, 1.5);
  painter.text('g', [shaft[0] - 12, (shaft[1] + tip[1]) / 2], faint, 'right');
}

/** Draw the bodies, links and wheels of a state, what is farthest first. */
function drawState(painter, camera, stage, { t, y, p }, colour, isNamed) {
  const places = stage.places(t, y, p);
  if (!places.flat().every(Number.isFinite)) return places;
  const ink = painter.colour(colour === 'mass' ? 'ink' : colour);
  const { bodies, links, outlines, wheels } = stage.stage;
  const parts = links.map(({ kind, ends }, k) => ({
    depth: (camera.depth(places[ends[0]]) + camera.depth(places[ends[1]])) / 2,
    draw: () => {
      const [a, b] = ends.map((end) => camera.pixel(places[end]));
      const dash = kind === 'radius' ? [4, 4] : [];
      for (const line of linkLines(kind, a, b, stage.turns?.[k])) {
        painter.line(line, ink, WIDTHS[kind] ?? 1.2, dash);
      }
    },
  }));
  for (const wheel of wheels) {
    const lines = stage.wheel(wheel, places, t, y, p);
    parts.push({
      depth: camera.depth(places[wheel.body]),
      draw: () => lines.forEach((line) => painter.line(line.map((q) => camera.pixel(q)), ink, WIDTHS.wheel)),
    });
  }
  for (const outline of outlines) {
    const lines = stage.outline(outline, places, t, y, p, camera);
    const width = WIDTHS[outline.shape === 'rod' ? 'rod' : 'body'];
    parts.push({
      depth: camera.depth(places[outline.body]),
      draw: () => {
        lines.forEach((line) => painter.line(line.map((q) => camera.pixel(q)), ink, width));
        if (outline.shape !== 'sphere') return;
        const radius = camera.scale * Math.hypot(...stage.spans(outline, t, y, p)[0]);
        painter.circle(camera.pixel(places[outline.body]), radius, ink, width);
      },
    });
  }
  bodies.forEach(({ kind, name }, k) => parts.push({
    depth: camera.depth(places[k]) + 1e-9,
    draw: () => {
      const at = camera.pixel(places[k]);
      painter.disk(at, kind === 'mass' ? stage.radius : 3, kind === 'mass' ? painter.colour(colour) : ink);
      if (isNamed && name) painter.text(name, [at[0] + 9, at[1] - 9], ink);
    },
  }));
  parts.sort((a, b) => a.depth - b.depth).forEach(({ draw }) => draw());
  return places;
}
