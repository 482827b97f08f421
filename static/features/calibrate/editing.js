// What can be done to clicked points: add, move, nudge, remove, select.
import { BORDERS, change, doc, pointsOf, withPoints } from "../../core/document.js";
import { active, kindOf, selectedPoints, selection, snapshot } from "../../core/state.js";
import { isOn, pointOn, reveal } from "../../canvas/viewport.js";

/**
 * @typedef {import("../../core/types").Doc} Doc
 * @typedef {import("../../core/types").Pick} Pick
 * @typedef {import("../../core/types").Point} Point
 */

/** A point that stays on the picture. @param {number} x @param {number} y */
const onPicture = (x, y) => pointOn(snapshot.value, x, y);

/** @param {number} x @param {number} y */
export const isOnPicture = (x, y) => isOn(snapshot.value, x, y);

/**
 * The document with one more point on a feature; a landmark has only one.
 * @param {Doc} before
 * @param {string} feature
 * @param {number} x
 * @param {number} y
 */
export function withAdded(before, feature, x, y) {
  const kind = kindOf(feature);
  const points =
    kind === "landmark" ? [onPicture(x, y)] : [...pointsOf(before, feature), onPicture(x, y)];
  return {
    next: withPoints(before, feature, points, kind),
    pick: { feature, index: points.length - 1 },
  };
}

/**
 * The document with some points moved.
 * @param {Doc} before
 * @param {Pick[]} picks
 * @param {number} dx
 * @param {number} dy
 */
export function withMoved(before, picks, dx, dy) {
  return picks.reduce((next, { feature, index }) => {
    const points = pointsOf(next, feature).map((p, i) =>
      i === index ? onPicture(p[0] + dx, p[1] + dy) : p,
    );
    return withPoints(next, feature, points, kindOf(feature));
  }, before);
}

/** @param {number} dx @param {number} dy px */
export function nudge(dx, dy) {
  change(withMoved(doc.value, selectedPoints.value, dx, dy));
  const last = selectedPoints.value.at(-1),
    point = last && pointsOf(doc.value, last.feature)[last.index];
  if (point) reveal(...point);
}

/** Remove points; the selection goes to a neighbour, so that the keyboard keeps its place. @param {Pick[]} picks */
export function remove(picks) {
  const gone = (/** @type {string} */ feature) =>
    new Set(picks.filter((p) => p.feature === feature).map((p) => p.index));
  change(
    [...new Set(picks.map((p) => p.feature))].reduce((next, feature) => {
      const out = gone(feature);
      return withPoints(
        next,
        feature,
        pointsOf(next, feature).filter((_, i) => !out.has(i)),
        kindOf(feature),
      );
    }, doc.value),
  );
  const [first] = picks,
    left = first ? pointsOf(doc.value, first.feature).length : 0;
  selection.value =
    first && left ? [{ feature: first.feature, index: Math.min(first.index, left - 1) }] : [];
}

/** All points in the order in which the eye meets them: border after border, along each one. @returns {Pick[]} */
function inOrder() {
  return doc.value.observations
    .filter((o) => typeof o.feature === "string")
    .flatMap((o) => {
      const run = o.feature === "left" || o.feature === "right" ? 1 : 0;
      return o.points
        .map((p, index) => ({ feature: /** @type {string} */ (o.feature), index, at: p[run] }))
        .toSorted((a, b) => a.at - b.at)
        .map(({ feature, index }) => ({ feature, index }));
    });
}

/** Select the next or the previous point. round: after the last comes the first. Returns whether there was one.
 * @param {1 | -1} way @param {boolean} round */
export function selectNext(way, round) {
  const all = inOrder(),
    last = selectedPoints.value.at(-1);
  if (!all.length) return false;
  const at = last
    ? all.findIndex((p) => p.feature === last.feature && p.index === last.index)
    : way > 0
      ? Math.max(-1, all.findIndex((p) => p.feature === active.value) - 1)
      : all.length;
  const next = at + way;
  if (!round && (next < 0 || next >= all.length)) return false;
  select([all[(next + all.length) % all.length]]);
  return true;
}

/** @param {Pick[]} picks */
export function select(picks) {
  selection.value = picks;
  const last = picks.at(-1);
  if (!last) return;
  active.value = last.feature;
  const point = pointsOf(doc.value, last.feature)[last.index];
  if (point) reveal(...point);
}

/** Make a border or another feature the one that is being clicked. @param {string} feature */
export function activateFeature(feature) {
  active.value = feature;
  selection.value = [];
}

/**
 * Those on what a field has; borders every field has.
 * @param {import("../../core/types").Observation[]} observations
 * @param {import("../../core/types").Field} field
 */
export function onField(observations, field) {
  const known = new Set([
    ...BORDERS,
    ...field.lines.map((l) => l.name),
    ...field.arcs.map((a) => a.name),
    ...Object.keys(field.landmarks),
  ]);
  return observations.filter((o) => typeof o.feature !== "string" || known.has(o.feature));
}
