// The drawing of a state: bodies, links, wheels and curves of the stage.

/** Half the width of springs and the radius of bodies, in pixels. */
const [SPRING, BODY] = [7, 6];

const FONT = '13px system-ui, sans-serif';

/** Where everything of the stage is at a state. */
class Stage {
  constructor(stage, initial) {
    this.stage = stage;
    this.usual = initial;
    this.radius = stage.bodies.length > 60 ? 3 : BODY;
    const numbered = (isOne) => stage.bodies.flatMap((body, k) => (isOne(body) ? [k] : []));
    const masses = numbered(({ kind }) => kind === 'mass');
    // What has a trace and is dragged: particles, or the named points of a scene without particles.
    this.leading = masses.length ? masses : numbered(({ name }) => name);
  }

  /**
   * What is drawn of a state: its numbers, the emitted positions, and the places of all bodies,
   * each of three numbers.
   */
  scene(t, y, p) {
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
    return { t, y, p, positions, places };
  }

  places(t, y, p) {
    return this.scene(t, y, p).places;
  }

  /** The vectors that span the outline of a rigid body. */
  spans({ spans }, { y, positions }) {
    return spans.map((span) => located(span, y, positions));
  }

  /** Places of all bodies, and the ends of what spans their outlines. */
  reach(t, y, p) {
    const scene = this.scene(t, y, p);
    const { places } = scene;
    const ends = this.stage.outlines.flatMap((outline) => this.spans(outline, scene).flatMap(
      (span) => [1, -1].map((sign) => places[outline.body].map((x, i) => x + sign * span[i])),
    ));
    return [...places, ...ends];
  }

  /** Lines of the outline of a rigid body, seen by a camera. */
  outline(outline, scene, camera) {
    const centre = scene.places[outline.body];
    const spans = this.spans(outline, scene);
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

  /** Where the centre of a wheel goes as its angle grows: a disk on a plane turns about its normal. */
  heading(wheel, { t, y, p, positions, places }) {
    const by = 1e-6 * (span[1] - span[0]);
    const ahead = y.map((value, k) => (k < count ? value + by * y[count + k] : value));
    const moved = system.positions(t, ahead, p);
    const [source, k] = wheel.angle ?? [];
    const turn = source === 'coordinate' ? ahead[k] - y[k] : moved[k] - positions[k];
    const way = located(this.stage.bodies[wheel.body].at, ahead, moved)
      .map((x, i) => x - places[wheel.body][i]);
    const rise = dot(way, wheel.normal);
    const along = way.map((x, i) => x - rise * wheel.normal[i]);
    const length = Math.hypot(...along) * Math.sign(turn);
    return Math.abs(length) > 1e-12 ? along.map((x) => x / length) : wheel.towards;
  }

  /** The rim of a wheel and its spoke, if its angle is known. */
  wheel(wheel, scene) {
    const { y, p, positions, places } = scene;
    const centre = places[wheel.body];
    const towards = wheel.ground ? wheel.towards : this.heading(wheel, scene);
    const radius = wheel.isParameter ? p[wheel.radius] : wheel.radius;
    const rim = (angle) => centre.map(
      (x, i) => x - radius * (Math.cos(angle) * wheel.normal[i] + Math.sin(angle) * towards[i]),
    );
    const line = Array.from({ length: 61 }, (_, k) => rim((2 * Math.PI * k) / 60));
    if (!wheel.angle || (wheel.ground && !wheel.isStraight)) return [line];
    const [source, k] = wheel.angle;
    return [line, [centre, rim((source === 'coordinate' ? y : positions)[k])]];
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

/** Colours of the style sheet, which are read again when light and dark change places. */
const colours = {
  known: new Map(),
  of(name) {
    if (!this.known.has(name)) {
      const style = getComputedStyle(document.documentElement);
      this.known.set(name, style.getPropertyValue(`--${name}`).trim());
    }
    return this.known.get(name);
  },
};

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
  }

  /** Keep what is drawn, so that it can be drawn again below other marks. */
  keep() {
    const { width, height } = this.canvas;
    this.kept = this.kept ?? document.createElement('canvas');
    if (!width || !height) return;
    Object.assign(this.kept, { width, height });
    this.kept.getContext('2d').drawImage(this.canvas, 0, 0);
  }

  recall() {
    this.clear();
    if (!this.kept?.width) return;
    this.context.save();
    this.context.setTransform(1, 0, 0, 1, 0, 0);
    this.context.drawImage(this.kept, 0, 0);
    this.context.restore();
  }

  line(points, colour, width = 1) {
    this.begin({ colour, width });
    this.trace(points);
    this.context.stroke();
  }

  /** Draw parts in their order; neighbours of one style are one path. */
  parts(parts) {
    parts.forEach((part, k) => {
      if (!k || !isAlike(part, parts[k - 1])) this.begin(part);
      for (const line of part.lines ?? []) this.trace(line);
      if (part.disk) this.round(part.disk, part.radius);
      if (k + 1 < parts.length && isAlike(part, parts[k + 1])) return;
      if (part.disk) this.context.fill();
      else this.context.stroke();
    });
  }

  begin({ colour, width, dash = [] }) {
    const { context } = this;
    context.beginPath();
    context.strokeStyle = colour;
    context.fillStyle = colour;
    context.lineWidth = width ?? 1;
    context.lineJoin = 'round';
    context.setLineDash(dash);
  }

  trace(points) {
    points.forEach(([x, y], k) => (k ? this.context.lineTo(x, y) : this.context.moveTo(x, y)));
  }

  round([x, y], radius) {
    this.context.moveTo(x + radius, y);
    this.context.arc(x, y, radius, 0, 2 * Math.PI);
  }

  disk(at, radius, colour) {
    this.begin({ colour });
    this.round(at, radius);
    this.context.fill();
  }

  widthOf(words) {
    this.context.font = FONT;
    return this.context.measureText(words).width;
  }

  text(words, [x, y], colour, align = 'left') {
    const { context } = this;
    context.font = FONT;
    context.textAlign = align;
    context.fillStyle = colour;
    context.fillText(words, x, y);
  }
}

function isAlike(part, other) {
  return Boolean(part.disk) === Boolean(other.disk) && part.colour === other.colour
    && part.width === other.width && part.radius === other.radius && !part.dash && !other.dash;
}

/** Lines of a link between two pixels; `slack` is √(l² − d²) of a rope that is not taut. */
function linkLines(kind, [x0, y0], [x1, y1], turns, slack) {
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
  if (slack > 0) {
    // A parabola below the chord, with the sag of a rope nearly taut.
    return [Array.from({ length: 25 }, (_, k) => {
      const [x, y] = at(k / 24, 0);
      return [x, y + 0.433 * slack * 4 * (k / 24) * (1 - k / 24)];
    })];
  }
  return [[at(0, 0), at(1, 0)]];
}

/** √(l² − d²) of a rope, in pixels; 0 where it is taut, and of other links. */
function slackOf({ length, isParameter, ends: [a, b] }, { places, p }, camera) {
  if (length === undefined) return 0;
  const whole = (isParameter ? p[length] : length) ** 2;
  const missing = whole - places[a].reduce((sum, x, i) => sum + (x - places[b][i]) ** 2, 0);
  return missing > 1e-6 * whole ? camera.scale * Math.sqrt(missing) : 0;
}

const WIDTHS = { rod: 2.5, wheel: 1.5, body: 1.2 };

/** A straight line of pixels to beyond the edges of a drawing; other curves as they are. */
function prolonged(pixels, { width, height }) {
  const [first, last] = [pixels[0], pixels[pixels.length - 1]];
  const along = [last[0] - first[0], last[1] - first[1]];
  const length = Math.hypot(...along);
  const off = ([x, y]) => Math.abs((x - first[0]) * along[1] - (y - first[1]) * along[0]);
  if (!(length > 1) || pixels.some((pixel) => off(pixel) > 0.1 * length)) return pixels;
  const far = along.map((part) => (part * (width + height)) / length);
  return [first.map((x, k) => x - far[k]), last.map((x, k) => x + far[k])];
}

/** Draw what does not move: curves, the ground of wheels, the direction of gravity. */
function drawStill(painter, camera, stage, p) {
  const faint = colours.of('faint');
  const grounds = stage.stage.wheels.map((wheel) => wheel.ground).filter(Boolean);
  for (const line of [...stage.curves(p).map(({ points }) => points), ...grounds]) {
    painter.line(prolonged(line.map((place) => camera.pixel(place)), painter), faint, 1.2);
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

/** Depths that a picture of many parts tells apart; those of one depth share paths. */
const [FEW_PARTS, DEPTHS] = [60, 16];

/** Draw the bodies, links and wheels of a state, what is farthest first. */
function drawState(painter, camera, stage, { t, y, p }, colour, isNamed) {
  const scene = stage.scene(t, y, p);
  const { places } = scene;
  if (!places.every((place) => place.every(Number.isFinite))) return places;
  const pixels = places.map((place) => camera.pixel(place));
  const depths = places.map((place) => camera.depth(place));
  const ink = colours.of(colour === 'mass' ? 'ink' : colour);
  const parts = [
    ...linkParts(stage, scene, pixels, camera, ink),
    ...shapeParts(stage, scene, camera, depths, ink),
    ...bodyParts(stage, pixels, depths, ink, colours.of(colour)),
  ];
  painter.parts(sorted(parts));
  if (isNamed) drawNames(painter, stage.stage, pixels, ink);
  return places;
}

/** Where a name may stand from its body: right or left of it, above or below; and how far it reaches up or down. */
const CORNERS = [[9, -9], [9, 19], [-9, -9], [-9, 19]];
const NAME_REACH = 22;

/** Write names beside bodies, each at a corner where no line and no other name stands; else not at all. */
function drawNames(painter, { bodies, links }, pixels, colour) {
  const taken = [];
  bodies.forEach(({ name }, k) => {
    if (!name) return;
    const width = painter.widthOf(name);
    const ways = links.filter(({ ends }) => ends.includes(k))
      .map(({ ends: [a, b] }) => pixels[a === k ? b : a].map((x, i) => x - pixels[k][i]));
    const corners = CORNERS.map(([right, below]) => ({
      x: pixels[k][0] + right - (right < 0 ? width : 0), y: pixels[k][1] + below, width,
      isCrossed: ways.some((way) => isBetween(way, [right, below])),
    }));
    const isFree = (a) => taken.every((b) => Math.abs(a.y - b.y) > 13
      || a.x > b.x + b.width || b.x > a.x + a.width);
    const free = corners.find((a) => !a.isCrossed && isFree(a)) ?? corners.find(isFree);
    if (!free) return;
    taken.push(free);
    painter.text(name, [free.x, free.y], colour);
  });
}

/** Say whether a line from a body goes where a name begins, at a corner, or flatter than there. */
function isBetween([x, y], [right, below]) {
  return x * right > 0 && y * below > 0 && Math.abs(y * right) < NAME_REACH * Math.abs(x);
}

function linkParts(stage, scene, pixels, camera, colour) {
  const depths = scene.places.map((place) => camera.depth(place));
  return stage.stage.links.map((link, k) => {
    const { kind, ends: [a, b] } = link;
    return {
      depth: (depths[a] + depths[b]) / 2,
      lines: linkLines(kind, pixels[a], pixels[b], stage.turns?.[k], slackOf(link, scene, camera)),
      colour,
      width: WIDTHS[kind] ?? 1.2,
      dash: kind === 'radius' ? [4, 4] : undefined,
    };
  });
}

/** Wheels and the outlines of rigid bodies. */
function shapeParts(stage, scene, camera, depths, colour) {
  const { wheels, outlines } = stage.stage;
  const flat = (lines) => lines.map((line) => line.map((place) => camera.pixel(place)));
  const wheelParts = wheels.map((wheel) => ({
    depth: depths[wheel.body], lines: flat(stage.wheel(wheel, scene)), colour, width: WIDTHS.wheel,
  }));
  const outlineParts = outlines.map((outline) => {
    const lines = flat(stage.outline(outline, scene, camera));
    if (outline.shape === 'sphere') {
      const radius = camera.scale * Math.hypot(...stage.spans(outline, scene)[0]);
      lines.push(circleLine(camera.pixel(scene.places[outline.body]), radius));
    }
    const width = WIDTHS[outline.shape === 'rod' ? 'rod' : 'body'];
    return { depth: depths[outline.body], lines, colour, width };
  });
  return [...wheelParts, ...outlineParts];
}

function bodyParts(stage, pixels, depths, ink, colour) {
  return stage.stage.bodies.map(({ kind }, k) => ({
    depth: depths[k],
    isBody: true,
    disk: pixels[k],
    radius: kind === 'mass' ? stage.radius : 3,
    colour: kind === 'mass' ? colour : ink,
  }));
}

function circleLine([x, y], radius) {
  return Array.from({ length: 73 }, (_, k) => [
    x + radius * Math.cos((Math.PI * k) / 36), y + radius * Math.sin((Math.PI * k) / 36),
  ]);
}

/** Parts from the farthest to the nearest, bodies before what is as far as they. */
function sorted(parts) {
  const depths = parts.map(({ depth }) => depth);
  const [low, high] = [Math.min(...depths), Math.max(...depths)];
  const size = parts.length > FEW_PARTS && high > low ? (high - low) / DEPTHS : 0;
  for (const part of parts) part.level = size ? Math.floor((part.depth - low) / size) : part.depth;
  return parts.sort((a, b) => a.level - b.level || Boolean(a.isBody) - Boolean(b.isBody));
}
