// Edits matches: click, move, nudge, remove, select. A match is one thing, a point in each picture.
import { chosen, nextHeight, other, pair, pictures, side, views, wantedHeight } from "./pair.js";

/**
 * @typedef {import("./types").Side} Side
 * @typedef {import("./types").PairDoc} PairDoc
 * @typedef {import("../../core/types").Point} Point
 */

/** A hundredth of a pixel is finer than anybody can click. @param {number} v */
const rounded = (v) => Math.round(v * 100) / 100;

/** A point that stays on its picture. @param {Side} s @param {number} x @param {number} y @returns {Point} */
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
 * @param {PairDoc} before
 * @param {number} index
 * @param {Partial<import("./types").Match>} changes
 * @returns {PairDoc}
 */
export const withMatch = (before, index, changes) => ({
  ...before,
  matches: before.matches.map((m, i) => (i === index ? { ...m, ...changes } : m)),
});

/**
 * The document with one more click: the point that a match waits for in this picture, else a new match.
 * @param {PairDoc} before
 * @param {Side} s
 * @param {number} x
 * @param {number} y
 */
export function withClick(before, s, x, y) {
  const point = onPicture(s, x, y),
    next = wantedHeight.value;
  const waits =
    !next.isNew && next.side === s ? next.index : before.matches.findIndex((m) => !m[s] && m[other(s)]);
  if (waits >= 0) return { next: withMatch(before, waits, { [s]: point }), index: waits };
  const fresh = { a: null, b: null, z_mm: nextHeight.value, [s]: point };
  return { next: { ...before, matches: [...before.matches, fresh] }, index: before.matches.length };
}

/** @param {PairDoc} before @param {Side} s @param {number} index @param {number} dx @param {number} dy */
export function withMoved(before, s, index, dx, dy) {
  const point = before.matches[index]?.[s];
  return point ? withMatch(before, index, { [s]: onPicture(s, point[0] + dx, point[1] + dy) }) : before;
}

/** @param {number} dx @param {number} dy px */
export function nudgeChosen(dx, dy) {
  const it = chosen.value;
  if (!it) return;
  pair.change(withMoved(pair.doc.value, it.side, it.index, dx, dy));
  const point = pair.doc.value.matches[it.index]?.[it.side];
  if (point) views[it.side].reveal(...point);
}

/** The chosen point, if it is still there. */
export function chosenPoint() {
  const it = chosen.value;
  return it ? (pair.doc.value.matches[it.index]?.[it.side] ?? null) : null;
}

/** Remove a match, both its points; undo brings it back. @param {number} index */
export function removeMatch(index) {
  pair.change({ ...pair.doc.value, matches: pair.doc.value.matches.filter((_, i) => i !== index) });
  const left = pair.doc.value.matches.length;
  if (left) choose(Math.min(index, left - 1));
  else chosen.value = null;
}

/** Choose a match, and bring its points into sight. @param {number} index @param {Side} [s] */
export function choose(index, s = side.value) {
  const match = pair.doc.value.matches[index];
  if (!match) return;
  const there = match[s] ? s : other(s);
  chosen.value = { side: there, index };
  side.value = there;
  for (const each of /** @type {Side[]} */ (["a", "b"])) {
    const point = match[each];
    if (point) views[each].reveal(...point);
  }
}

/** @param {1 | -1} way */
export function chooseNext(way) {
  const count = pair.doc.value.matches.length;
  if (count) choose(((chosen.value?.index ?? (way > 0 ? -1 : count)) + way + count) % count);
}

/** @param {number} index @param {number | null} z_mm */
export const setHeight = (index, z_mm) => pair.change(withMatch(pair.doc.value, index, { z_mm }));

/** A point by keyboard; then the other picture's turn. @param {Side} s @param {Point} at */
export function addMatchPoint(s, at) {
  const { next, index } = withClick(pair.doc.value, s, ...at);
  pair.change(next);
  chosen.value = { side: s, index };
  side.value = next.matches[index][other(s)] ? s : other(s);
}
