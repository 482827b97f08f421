// How a field's markings move: what is joined moves together, and a new size takes everything with it. Field mm.

/**
 * @typedef {import("../../core/types").Point} Point
 * @typedef {import("./types").FieldDoc} FieldDoc
 * @typedef {import("./types").Mark} Mark
 * @typedef {import("./types").Grip} Grip
 */

export const SAME_MM = 1; // places so near are one, as where lines meet
const FAR = 0.5; // of half the field: beyond it, what keeps its size goes with the border

/** A tenth of a millimetre is finer than any tape. @param {number} v */
export const rounded = (v) => Math.round(v * 10) / 10 + 0;
/** @param {number} x @param {number} y @returns {Point} */
const point = (x, y) => [rounded(x), rounded(y)];

/** @param {Point} p @param {Point} q */
export const apart = (p, q) => Math.hypot(p[0] - q[0], p[1] - q[1]);

/** How far a place is from a line between its ends. @param {Point} p @param {{ from: Point, to: Point }} line */
export function fromLine([x, y], { from, to }) {
  const dx = to[0] - from[0],
    dy = to[1] - from[1],
    t = ((x - from[0]) * dx + (y - from[1]) * dy) / (dx * dx + dy * dy || 1),
    along = Math.min(1, Math.max(0, t));
  return apart([x, y], [from[0] + along * dx, from[1] + along * dy]);
}

/** How far a place is from an arc. @param {Point} p @param {import("../../core/types").Arc} arc */
export function fromArc(p, { centre, radius_mm, start_deg, end_deg }) {
  const angle = (Math.atan2(p[1] - centre[1], p[0] - centre[0]) * 180) / Math.PI,
    past = (((angle - start_deg) % 360) + 360) % 360;
  if (past <= end_deg - start_deg) return Math.abs(apart(p, centre) - radius_mm);
  return Math.min(
    apart(p, onArc(centre, radius_mm, start_deg)),
    apart(p, onArc(centre, radius_mm, end_deg)),
  );
}

/** @param {Point} centre @param {number} radius @param {number} deg @returns {Point} */
export const onArc = ([x, y], radius, deg) => [
  x + radius * Math.cos((deg * Math.PI) / 180),
  y + radius * Math.sin((deg * Math.PI) / 180),
];

/**
 * The field with every place where a function takes it: ends of lines, centres of arcs, landmarks.
 * @param {FieldDoc} doc
 * @param {(place: Point, mark: Mark) => Point} to
 * @returns {FieldDoc}
 */
const withPlaces = (doc, to) => ({
  ...doc,
  lines: doc.lines.map((line) => {
    const mark = /** @type {Mark} */ ({ kind: "line", name: line.name });
    return { ...line, from: to(line.from, mark), to: to(line.to, mark) };
  }),
  arcs: doc.arcs.map((arc) => ({
    ...arc,
    centre: to(arc.centre, { kind: "arc", name: arc.name }),
  })),
  landmarks: Object.fromEntries(
    Object.entries(doc.landmarks).map(([name, place]) => [
      name,
      to(place, { kind: "landmark", name }),
    ]),
  ),
});

/** @param {Mark[]} marks @param {Mark} mark */
export const includes = (marks, { kind, name }) =>
  marks.some((m) => m.kind === kind && m.name === name);

/**
 * Move marks. What ends or lies on them goes with them, and so do edges of regions along a line, unless `alone`.
 * @param {FieldDoc} doc
 * @param {Mark[]} marks
 * @param {Point} by
 * @param {boolean} [alone]
 */
export function withMoved(doc, marks, [dx, dy], alone = false) {
  const lines = doc.lines.filter(({ name }) => includes(marks, { kind: "line", name })),
    arcs = doc.arcs.filter(({ name }) => includes(marks, { kind: "arc", name })),
    spots = Object.entries(doc.landmarks)
      .filter(([name]) => includes(marks, { kind: "landmark", name }))
      .map(([, p]) => p);
  const isOn = (/** @type {Point} */ p) =>
    !alone &&
    (lines.some((line) => fromLine(p, line) < SAME_MM) ||
      arcs.some((arc) => apart(p, arc.centre) < SAME_MM || fromArc(p, arc) < SAME_MM) ||
      spots.some((spot) => apart(p, spot) < SAME_MM));
  const moved = withPlaces(doc, (p, mark) =>
    includes(marks, mark) || isOn(p) ? point(p[0] + dx, p[1] + dy) : p,
  );
  return { ...moved, regions: alone ? doc.regions : withEdgesAlong(doc.regions, lines, [dx, dy]) };
}

/** @param {FieldDoc["regions"]} regions @param {import("../../core/types").Line[]} lines @param {Point} by */
function withEdgesAlong(regions, lines, [dx, dy]) {
  /** @param {number} at @param {0 | 1} axis @param {Point} span @param {number} by */
  const edge = (at, axis, span, by) =>
    lines.some(({ from, to }) => {
      const ends = [from[1 - axis], to[1 - axis]];
      return (
        [from[axis], to[axis]].every((v) => Math.abs(v - at) < SAME_MM) &&
        Math.min(...ends) < span[0] + SAME_MM &&
        Math.max(...ends) > span[1] - SAME_MM
      );
    })
      ? rounded(at + by)
      : at;
  return Object.fromEntries(
    Object.entries(regions).map(([name, r]) => [
      name,
      {
        ...r,
        x: /** @type {Point} */ (r.x.map((at) => edge(at, 0, r.y, dx))),
        y: /** @type {Point} */ (r.y.map((at) => edge(at, 1, r.x, dy))),
      },
    ]),
  );
}

/**
 * Move what is held to a place: the end of a line with all that meets there unless `alone`, the end or radius of an
 * arc, the edge of a region.
 * @param {FieldDoc} doc
 * @param {Grip} grip
 * @param {Point} to
 * @param {boolean} [alone]
 * @returns {FieldDoc}
 */
export function withGripAt(doc, { mark: { kind, name }, part }, to, alone = false) {
  if (kind === "region") {
    const axis = part[0] === "x" ? "x" : "y",
      span = /** @type {Point} */ ([...doc.regions[name][axis]]);
    span[Number(part[1])] = rounded(to[axis === "x" ? 0 : 1]);
    return { ...doc, regions: { ...doc.regions, [name]: { ...doc.regions[name], [axis]: span } } };
  }
  if (kind === "line") {
    const end = /** @type {"from" | "to"} */ (part),
      before = doc.lines.find((line) => line.name === name)?.[end];
    if (!before) return doc;
    if (!alone) return withPlaces(doc, (p) => (apart(p, before) < SAME_MM ? point(...to) : p));
    return {
      ...doc,
      lines: doc.lines.map((line) =>
        line.name === name ? { ...line, [end]: point(...to) } : line,
      ),
    };
  }
  const arc = doc.arcs.find((a) => a.name === name);
  if (!arc) return doc;
  if (part === "radius") return withRadius(doc, name, apart(to, arc.centre));
  const deg = Math.round(
      (Math.atan2(to[1] - arc.centre[1], to[0] - arc.centre[0]) * 180) / Math.PI,
    ),
    { start_deg: start, end_deg: end } = arc; // the other end stays; this one within a turn of it
  return part === "start"
    ? withArc(doc, name, { start_deg: end - ((((end - deg) % 360) + 360) % 360 || 360) })
    : withArc(doc, name, { end_deg: start + ((((deg - start) % 360) + 360) % 360 || 360) });
}

/** @param {FieldDoc} doc @param {string} name @param {Partial<import("./types").EditedArc>} changes */
export const withArc = (doc, name, changes) => ({
  ...doc,
  arcs: doc.arcs.map((arc) => (arc.name === name ? withNumbers(arc, changes) : arc)),
});

/** @template T @param {T} it @param {Partial<T>} changes @returns {T} */
const withNumbers = (it, changes) => ({ ...it, ...changes });

/** Landmarks on the arc stay on it. @param {FieldDoc} doc @param {string} name @param {number} radius */
export function withRadius(doc, name, radius) {
  const arc = doc.arcs.find((a) => a.name === name),
    wide = Math.max(1, rounded(radius));
  if (!arc) return doc;
  const { centre: c, radius_mm: before } = arc;
  return {
    ...withArc(doc, name, { radius_mm: wide }),
    landmarks: Object.fromEntries(
      Object.entries(doc.landmarks).map(([spot, p]) => [
        spot,
        fromArc(p, arc) < SAME_MM
          ? point(c[0] + ((p[0] - c[0]) * wide) / before, c[1] + ((p[1] - c[1]) * wide) / before)
          : p,
      ]),
    ),
  };
}

/**
 * The field at another size. how: "scale" takes everything with it; "borders" leaves penalty areas, circles and what is
 * in the middle as large as they are, and moves what is nearer to a border with that.
 * @param {FieldDoc} doc
 * @param {number} length
 * @param {number} width
 * @param {"scale" | "borders"} how
 * @returns {FieldDoc}
 */
export function withSize(doc, length, width, how) {
  const sx = length / doc.length_mm,
    sy = width / doc.width_mm,
    scale = how === "scale" ? Math.sqrt(sx * sy) : 1; // of circles: the same, whichever side is typed first
  const along = (
    /** @type {number} */ v,
    /** @type {number} */ before,
    /** @type {number} */ now,
  ) => {
    if (how === "scale") return (v * now) / before;
    return Math.abs(v) > (FAR * before) / 2 ? v + (Math.sign(v) * (now - before)) / 2 : v;
  };
  const resized = (/** @type {Point} */ [x, y]) =>
    /** @type {Point} */ ([along(x, doc.length_mm, length), along(y, doc.width_mm, width)]);
  const moved = withPlaces(doc, (p, { kind }) => {
    const arc = kind === "arc" ? undefined : doc.arcs.find((a) => fromArc(p, a) < SAME_MM);
    if (!arc) return point(...resized(p));
    const [x, y] = resized(arc.centre); // what lies on an arc stays on it: circles are not stretched
    return point(x + scale * (p[0] - arc.centre[0]), y + scale * (p[1] - arc.centre[1]));
  });
  return {
    ...moved,
    length_mm: length,
    width_mm: width,
    arcs: moved.arcs.map((arc) => withNumbers(arc, { radius_mm: rounded(arc.radius_mm * scale) })),
    regions: Object.fromEntries(
      Object.entries(doc.regions).map(([name, r]) => [
        name,
        { ...r, x: point(r.x[0] * sx, r.x[1] * sx), y: point(r.y[0] * sy, r.y[1] * sy) },
      ]),
    ),
  };
}
