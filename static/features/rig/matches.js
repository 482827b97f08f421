// Edits matches: click, move, nudge, remove, select. A match is one thing, a point in each image.
import { SIDES, chosen, desk, nextHeight, other, pictures, side, views, wanted } from "./match_desk.js";

/**
 * @typedef {import("./types").Side} Side
 * @typedef {import("./types").MatchDoc} MatchDoc
 * @typedef {import("../../core/types").Point} Point
 */

/** A hundredth of a pixel is finer than anybody can click. @param {number} v */
const rounded = (v) => Math.round(v * 100) / 100;

/** A point that stays on its image. @param {Side} s @param {number} x @param {number} y @returns {Point} */
function onPicture(s, x, y) {
  const { width, height } = pictures.value[s] ?? { width: 1, height: 1 };
  return [
    rounded(Math.min(Math.max(x, -0.5), width - 0.5)),
    rounded(Math.min(Math.max(y, -0.5), height - 0.5)),
  ];
}

/** @param {Side} s @param {number} x @param {number} y */
export function isOn(s, x, y) {
  const { width, height } = pictures.value[s] ?? { width: 0, height: 0 };
  return x >= -0.5 && y >= -0.5 && x <= width - 0.5 && y <= height - 0.5;
}

/**
 * @param {MatchDoc} before
 * @param {number} index
 * @param {Partial<import("./types").Match>} changes
 * @returns {MatchDoc}
 */
export const withMatch = (before, index, changes) => ({
  ...before,
  matches: before.matches.map((m, i) => (i === index ? { ...m, ...changes } : m)),
});

/**
 * The document with one more click: the point that a match waits for in this image, else a new match.
 * @param {MatchDoc} before
 * @param {Side} s
 * @param {number} x
 * @param {number} y
 */
export function withClick(before, s, x, y) {
  const point = onPicture(s, x, y),
    next = wanted.value;
  const waits =
    !next.isNew && next.side === s ? next.index : before.matches.findIndex((m) => !m[s] && m[other(s)]);
  if (waits >= 0) return { next: withMatch(before, waits, { [s]: point }), index: waits };
  const fresh = { a: null, b: null, z_mm: nextHeight.value, [s]: point };
  return { next: { ...before, matches: [...before.matches, fresh] }, index: before.matches.length };
}

/** @param {MatchDoc} before @param {Side} s @param {number} index @param {number} dx @param {number} dy */
export function withMoved(before, s, index, dx, dy) {
  const point = before.matches[index]?.[s];
  return point ? withMatch(before, index, { [s]: onPicture(s, point[0] + dx, point[1] + dy) }) : before;
}

/** @param {number} dx @param {number} dy px */
export function nudgeChosen(dx, dy) {
  const it = chosen.value;
  if (!it) return;
  desk.change(withMoved(desk.doc.value, it.side, it.index, dx, dy));
  const point = desk.doc.value.matches[it.index]?.[it.side];
  if (point) views[it.side].reveal(...point);
}

/** The chosen point, if it is still there. */
export function chosenPoint() {
  const it = chosen.value;
  return it ? (desk.doc.value.matches[it.index]?.[it.side] ?? null) : null;
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
  const { next, index } = withClick(desk.doc.value, s, ...at);
  desk.change(next);
  chosen.value = { side: s, index };
  side.value = next.matches[index][other(s)] ? s : other(s);
}
