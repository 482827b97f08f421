// What of a chosen marking can be held, and what a held place is drawn to. Field mm.
import { SAME_MM, apart, onArc } from "./geometry.js";

/**
 * @typedef {import("../../core/types").Point} Point
 * @typedef {import("./types").FieldDoc} FieldDoc
 * @typedef {import("./types").Mark} Mark
 * @typedef {import("./types").Grip} Grip
 */

const GRID_MM = 5;

/**
 * The same place, or another's that is within reach; else on a grid.
 * @param {FieldDoc} doc
 * @param {Point} p
 * @param {number} reach mm
 * @param {Point | null} except where it was: that holds nothing
 * @returns {Point}
 */
export function snapped(doc, p, reach, except) {
  const places = [
    ...doc.lines.flatMap(({ from, to }) => [from, to]),
    ...doc.arcs.map((arc) => arc.centre),
    ...Object.values(doc.landmarks),
  ].filter((place) => !except || apart(place, except) >= SAME_MM);
  const nearest = places.toSorted((a, b) => apart(a, p) - apart(b, p))[0];
  if (nearest && apart(nearest, p) < reach) return nearest;
  return [onGrid(p[0]), onGrid(p[1])];
}

/** @param {number} v */
export const onGrid = (v) => Math.round(v / GRID_MM) * GRID_MM + 0;

/** What of a chosen mark can be held. @param {FieldDoc} doc @param {Mark} mark @returns {Grip[]} */
export function gripsOf(doc, mark) {
  const { kind, name } = mark,
    line = kind === "line" && doc.lines.find((l) => l.name === name),
    arc = kind === "arc" && doc.arcs.find((a) => a.name === name),
    region = kind === "region" && doc.regions[name];
  if (line)
    return [
      { mark, part: "from", at: line.from },
      { mark, part: "to", at: line.to },
    ];
  if (arc) {
    const { centre, radius_mm: r, start_deg: start, end_deg: end } = arc,
      isFull = end - start >= 360;
    return [
      { mark, part: "radius", at: onArc(centre, r, (start + end) / 2) },
      ...(isFull
        ? []
        : [
            { mark, part: /** @type {const} */ ("start"), at: onArc(centre, r, start) },
            { mark, part: /** @type {const} */ ("end"), at: onArc(centre, r, end) },
          ]),
    ];
  }
  if (!region) return [];
  const [x0, x1] = region.x,
    [y0, y1] = region.y,
    middle = [(x0 + x1) / 2, (y0 + y1) / 2];
  return [
    { mark, part: "x0", at: [x0, middle[1]] },
    { mark, part: "x1", at: [x1, middle[1]] },
    { mark, part: "y0", at: [middle[0], y0] },
    { mark, part: "y1", at: [middle[0], y1] },
  ];
}
