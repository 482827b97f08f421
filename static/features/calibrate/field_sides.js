// The region as it lies in the corrected picture: where its sides are, and which painted line each border is.
import { field, region, rotation } from "../../core/state.js";

const ARC_STEPS = 48;

/**
 * @typedef {import("../../core/types").Point} Point
 * @typedef {import("../../core/types").Border} Border
 * @typedef {{ x: number, y: number, width: number, height: number }} Rect
 */

/**
 * Field mm to the drawing's mm, x right and y down, the field turned counter-clockwise.
 * @param {Point} p
 * @param {number} deg
 * @returns {Point}
 */
export function turned([x, y], deg) {
  const cos = [1, 0, -1, 0][deg / 90],
    sin = [0, 1, 0, -1][deg / 90];
  return [x * cos - y * sin, -x * sin - y * cos];
}

/** The region in the drawing. @param {import("../../core/types").Region} r @param {number} deg @returns {Rect} */
export function rectOf(r, deg) {
  const [a, b] = [turned([r.x[0], r.y[0]], deg), turned([r.x[1], r.y[1]], deg)];
  return {
    x: Math.min(a[0], b[0]),
    y: Math.min(a[1], b[1]),
    width: Math.abs(a[0] - b[0]),
    height: Math.abs(a[1] - b[1]),
  };
}

/** @param {Rect} r @param {Border} border @returns {[Point, Point]} */
export function sideOf({ x, y, width: w, height: h }, border) {
  const right = x + w,
    bottom = y + h;
  switch (border) {
    case "left":
      return [
        [x, y],
        [x, bottom],
      ];
    case "right":
      return [
        [right, y],
        [right, bottom],
      ];
    case "top":
      return [
        [x, y],
        [right, y],
      ];
    default:
      return [
        [x, bottom],
        [right, bottom],
      ];
  }
}

/** Which painted line a border is: "goal-line-right". @param {Border} border */
export function lineUnder(border) {
  if (!region.value || !field.value) return null;
  const side = sideOf(rectOf(region.value, rotation.value), border);
  return (
    field.value.lines.find(({ from, to }) => {
      const [a, b] = [turned(from, rotation.value), turned(to, rotation.value)];
      return side.every(([x, y]) => between(x, a[0], b[0]) && between(y, a[1], b[1]));
    })?.name ?? null
  );
}

/** Whether a line, an arc or a landmark has no part in the region. @param {string} name */
export function isOffArea(name) {
  const r = region.value,
    f = field.value,
    line = f?.lines.find((l) => l.name === name),
    arc = f?.arcs.find((a) => a.name === name),
    spot = f?.landmarks[name];
  const places = line ? alongLine(line) : arc ? arcPoints(arc) : spot ? [spot] : [];
  if (!r || !places.length) return false;
  return !places.some(([x, y]) => between(x, r.x[0], r.x[1]) && between(y, r.y[0], r.y[1]));
}

/** @param {import("../../core/types").Line} line @returns {Point[]} */
const alongLine = ({ from, to }) =>
  Array.from({ length: ARC_STEPS + 1 }, (_, i) => [
    from[0] + ((to[0] - from[0]) * i) / ARC_STEPS,
    from[1] + ((to[1] - from[1]) * i) / ARC_STEPS,
  ]);

/** @param {number} v @param {number} a @param {number} b */
const between = (v, a, b) => v >= Math.min(a, b) - 1 && v <= Math.max(a, b) + 1;

/** Places along an arc, field mm. @param {import("../../core/types").Arc} a @returns {Point[]} */
export function arcPoints({ centre, radius_mm, start_deg, end_deg }) {
  return Array.from({ length: ARC_STEPS + 1 }, (_, i) => {
    const angle = (start_deg + ((end_deg - start_deg) * i) / ARC_STEPS) * (Math.PI / 180);
    return [centre[0] + radius_mm * Math.cos(angle), centre[1] + radius_mm * Math.sin(angle)];
  });
}
