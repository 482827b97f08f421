// An arrow from where a place of a line was to where it is, magnified.

const LEAST = 0.002, // of the picture's diagonal: what is shorter is a dot
  HEAD = 0.011,
  APART = 0.035; // likewise: nearer to one that is drawn, another is not

/**
 * The places that are drawn: those with the longest arrows first, and none near another.
 * @template {{ was: import("../core/types").Point, mm: number }} Place
 * @param {Place[]} places
 * @param {number} diagonal of the picture
 */
export function drawnPlaces(places, diagonal) {
  const drawn = /** @type {Place[]} */ ([]);
  for (const place of places.toSorted((a, b) => b.mm - a.mm))
    if (drawn.every(({ was }) => apart(was, place.was) > APART * diagonal)) drawn.push(place);
  return drawn;
}

/** @param {import("../core/types").Point} a @param {import("../core/types").Point} b */
const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

/**
 * An SVG path, in pixels of the picture.
 * @param {{ was: import("../core/types").Point, now: import("../core/types").Point }} place
 * @param {number} times
 * @param {number} diagonal of the picture
 */
export function arrowPath({ was: [x, y], now }, times, diagonal) {
  const dx = times * (now[0] - x),
    dy = times * (now[1] - y),
    length = Math.hypot(dx, dy);
  if (length < LEAST * diagonal) return `M${x} ${y}h0.01`;
  const head = Math.min(HEAD * diagonal, 0.5 * length) / length,
    [ex, ey] = [x + dx, y + dy];
  /** @param {number} side */
  const barb = (side) =>
    `${fixed(ex - head * (dx + 0.55 * side * dy))} ${fixed(ey - head * (dy - 0.55 * side * dx))}`;
  return `M${x} ${y}L${fixed(ex)} ${fixed(ey)}M${barb(1)}L${fixed(ex)} ${fixed(ey)}L${barb(-1)}`;
}

/** @param {number} value */
const fixed = (value) => value.toFixed(1);
