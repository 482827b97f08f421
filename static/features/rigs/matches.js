// Edits matches: click, move, nudge, remove, select. A match is one thing, a point in each image.
import { pointOn } from "../../canvas/viewport.js";
import {
  SIDES,
  chosen,
  desk,
  nextHeight,
  other,
  pictures,
  side,
  views,
  wanted,
} from "./match_desk.js";

/**
 * @typedef {import("./types").Side} Side
 * @typedef {import("./types").MatchDoc} MatchDoc
 * @typedef {import("../../core/types").Point} Point
 */

/** @param {MatchDoc} before @param {number} index @param {Partial<import("./types").Match>} changes */
const withMatch = ({ matches, ...before }, index, changes) => ({
  ...before,
  matches: matches.with(index, { ...matches[index], ...changes }),
});

/**
 * The document with one more click: the point that a match waits for in this image, else a new match.
 * @param {MatchDoc} before @param {Side} s @param {Point} at
 */
export function withClick(before, s, at) {
  const point = pointOn(pictures.value[s], ...at),
    next = wanted.value,
    waits =
      !next.isNew && next.side === s
        ? next.index
        : before.matches.findIndex((m) => !m[s] && m[other(s)]);
  if (waits >= 0) return { next: withMatch(before, waits, { [s]: point }), index: waits };
  const fresh = { a: null, b: null, z_mm: nextHeight.value, [s]: point };
  return { next: { ...before, matches: [...before.matches, fresh] }, index: before.matches.length };
}

/** @param {MatchDoc} before @param {Side} s @param {number} index @param {number} dx @param {number} dy */
export function withMoved(before, s, index, dx, dy) {
  const point = before.matches[index]?.[s];
  return point
    ? withMatch(before, index, { [s]: pointOn(pictures.value[s], point[0] + dx, point[1] + dy) })
    : before;
}

/** The chosen point, if it is still there. */
export const chosenPoint = () =>
  chosen.value ? (desk.doc.value.matches[chosen.value.index]?.[chosen.value.side] ?? null) : null;

/** @param {number} dx @param {number} dy px */
export function nudgeChosen(dx, dy) {
  const it = chosen.value;
  if (!it) return;
  desk.change(withMoved(desk.doc.value, it.side, it.index, dx, dy));
  const point = chosenPoint();
  if (point) views[it.side].reveal(...point);
}

/** Remove a match, both its points; undo brings it back. @param {number} index */
export function removeMatch(index) {
  desk.change({ ...desk.doc.value, matches: desk.doc.value.matches.filter((_, i) => i !== index) });
  const left = desk.doc.value.matches.length;
  if (left) choose(Math.min(index, left - 1));
  else chosen.value = null;
}

/** Choose a match, and bring its points into sight. @param {number} index @param {Side} [s] */
export function choose(index, s = side.value) {
  const match = desk.doc.value.matches[index];
  if (!match) return;
  const there = match[s] ? s : other(s);
  chosen.value = { side: there, index };
  side.value = there;
  for (const each of SIDES) {
    const point = match[each];
    if (point) views[each].reveal(...point);
  }
}

/** @param {1 | -1} way */
export function chooseNext(way) {
  const count = desk.doc.value.matches.length;
  if (count) choose(((chosen.value?.index ?? (way > 0 ? -1 : count)) + way + count) % count);
}

/** @param {number} index @param {number | null} z_mm */
export const setHeight = (index, z_mm) => desk.change(withMatch(desk.doc.value, index, { z_mm }));

/** A point by keyboard; then the other image's turn. @param {Side} s @param {Point} at */
export function addMatchPoint(s, at) {
  const { next, index } = withClick(desk.doc.value, s, at);
  desk.change(next);
  chosen.value = { side: s, index };
  side.value = next.matches[index][other(s)] ? s : other(s);
}
