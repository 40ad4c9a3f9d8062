// From places in space to pixels: a flat view, or one that turns about the vertical.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];

/** How many times its size a system may go in a drawing that does not follow it. */
const FAR = 6;

/** The camera of a drawing. */
class Camera {
  constructor({ rows, isFlat }) {
    this.isFlat = isFlat;
    this.rows = rows;
    // In space the axis that goes up in the sketch is that about which the view turns.
    this.up = [0, 0, 0];
    if (!isFlat) {
      const vertical = [0, 1, 2].find((axis) => rows[0][axis] === 0);
      this.up[vertical ?? 2] = Math.sign(rows[1][vertical ?? 2]) || 1;
      this.first = [0, 1, 2].map((axis) => (axis === ((vertical ?? 2) + 1) % 3 ? 1 : 0));
      this.second = cross(this.up, this.first);
    }
    this.azimuth = -0.6;
    this.elevation = 0.3;
    this.turn(0, 0);
  }

  /** Turn a view in space by two angles. */
  turn(azimuth, elevation) {
    if (this.isFlat) return;
    this.azimuth += azimuth;
    this.elevation = Math.max(-1.5, Math.min(1.5, this.elevation + elevation));
    const [c, s] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const right = this.first.map((x, i) => -s * x + c * this.second[i]);
    const away = this.first.map((x, i) => c * x + s * this.second[i]);
    const [a, b] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    this.rows = [right, this.up.map((x, i) => a * x - b * away[i])];
    this.towards = this.up.map((x, i) => b * x + a * away[i]);
  }

  /**
   * Fit the places of several times into a canvas of so many pixels. A system that goes much farther
   * than it is large is followed.
   */
  fit(times, width, height) {
    const boxes = times.map((places) => this.box(places));
    const low = [0, 1].map((k) => Math.min(...boxes.map((box) => box.low[k])));
    const high = [0, 1].map((k) => Math.max(...boxes.map((box) => box.high[k])));
    let extents = [0, 1].map((k) => high[k] - low[k]);
    const size = Math.max(...boxes.flatMap((box) => [0, 1].map((k) => box.high[k] - box.low[k])));
    this.isFollowing = size > 0 && Math.max(...extents) > FAR * size;
    if (this.isFollowing) extents = [2 * size, 2 * size];
    const extent = Math.max(...extents, 1e-300);
    const padded = extents.map((x) => Math.max(x, 0.1 * extent) * 1.25);
    this.scale = Math.min(width / padded[0], height / padded[1]);
    this.middle = [0, 1].map((k) => (low[k] + high[k]) / 2);
    this.centre = [width / 2, height / 2];
  }

  /** Look at places, if the system is one that is followed. */
  follow(places) {
    if (!this.isFollowing) return;
    const { low, high } = this.box(places);
    this.middle = [0, 1].map((k) => (low[k] + high[k]) / 2);
  }

  box(places) {
    const flat = places.map((place) => this.plane(place));
    return {
      low: [0, 1].map((k) => Math.min(...flat.map((f) => f[k]))),
      high: [0, 1].map((k) => Math.max(...flat.map((f) => f[k]))),
    };
  }

  plane(place) {
    return [dot(this.rows[0], place), dot(this.rows[1], place)];
  }

  /** Pixels of a place in space, y downwards. */
  pixel(place) {
    const [x, y] = this.plane(place);
    return [
      this.centre[0] + this.scale * (x - this.middle[0]),
      this.centre[1] - this.scale * (y - this.middle[1]),
    ];
  }

  /** How near a place is to the viewer; 0 in a flat view. */
  depth(place) {
    return this.isFlat ? 0 : dot(this.towards, place);
  }
}
