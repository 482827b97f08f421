// The pick tool: press on a point to drag it, press beside one to add one; Shift and drag selects a box.
import { cancelDrag, doc, endDrag, showWhileDragging } from "../../core/document.js";
import { active, box, selectedPoints, selection } from "../../core/state.js";
import { toPicture, toStage } from "../viewport.js";
import { isOnPicture, select, withAdded, withMoved } from "../../features/calibrate/editing.js";
import { featureAt } from "../../features/calibrate/line_suggestions.js";
import { snapPoints, snapping } from "../../features/calibrate/snapping.js";

/**
 * @typedef {import("../../core/types").Pick} Pick
 * @typedef {{ x: number, y: number, touch: boolean, shift: boolean, ctrl: boolean, alt: boolean }} At stage pixels;
 * alt: placed freely
 */

const REACH_PX = 11,
  REACH_TOUCH_PX = 22; // how near a press must be to hold a point
const OTHERS = 0.5; // of that for points of other lines: where lines cross, a press means the active one
const STILL_PX = 3; // a press that moves less is a click: hands shake

/**
 * @type {{ before: import("../../core/types").Doc, from: At, picks: Pick[], added: boolean, moved: boolean, last: At }
 * | null}
 */
let drag = null;

/** The nearest point within reach. @param {At} at @returns {Pick | null} */
export function pointAt({ x, y, touch }) {
  let best = null,
    nearest = 1; // of the reach
  for (const { feature, points } of doc.value.observations) {
    if (typeof feature !== "string") continue;
    const reach = (touch ? REACH_TOUCH_PX : REACH_PX) * (feature === active.value ? 1 : OTHERS);
    points.forEach((p, index) => {
      const [sx, sy] = toStage(...p),
        share = Math.hypot(sx - x, sy - y) / reach;
      if (share < nearest) {
        best = { feature, index };
        nearest = share;
      }
    });
  }
  return best;
}

/** @param {At} at */
function down(at) {
  const hit = pointAt(at),
    before = doc.value;
  if (at.shift && !hit) {
    box.value = { x0: at.x, y0: at.y, x1: at.x, y1: at.y };
  } else if (hit && (at.ctrl || at.shift)) {
    const rest = selectedPoints.value.filter((p) => !isSame(p, hit));
    selection.value = rest.length < selectedPoints.value.length ? rest : [...rest, hit];
  } else if (hit) {
    const picks = selectedPoints.value.some((p) => isSame(p, hit)) ? selectedPoints.value : [hit];
    selection.value = picks;
    active.value = hit.feature;
    drag = { before, from: at, picks, added: false, moved: false, last: at };
  } else if (isOnPicture(...toPicture(at.x, at.y))) {
    if (!at.alt) active.value = featureAt(toPicture(at.x, at.y), at.touch);
    const { next, pick } = withAdded(before, active.value, ...toPicture(at.x, at.y));
    showWhileDragging(next);
    selection.value = [pick];
    drag = { before, from: at, picks: [pick], added: true, moved: false, last: at };
  }
}

/** @param {At} at */
function move(at) {
  if (box.value) box.value = { ...box.value, x1: at.x, y1: at.y };
  if (!drag) return;
  const { before, from, picks, added } = drag;
  drag.last = at;
  if (!drag.moved && Math.hypot(at.x - from.x, at.y - from.y) < STILL_PX) return;
  drag.moved = true;
  const [x0, y0] = toPicture(from.x, from.y),
    [x, y] = toPicture(at.x, at.y);
  const start = added ? withAdded(before, picks[0].feature, x0, y0).next : before;
  showWhileDragging(withMoved(start, picks, x - x0, y - y0));
}

function up() {
  if (box.value) {
    const { x0, y0, x1, y1 } = box.value;
    box.value = null;
    select(within(Math.min(x0, x1), Math.min(y0, y1), Math.max(x0, x1), Math.max(y0, y1)));
  }
  const done = drag;
  drag = null;
  if (!done || !(done.moved || done.added)) return;
  endDrag(done.before);
  // Several that are moved together keep their places to each other.
  if (snapping.value && !done.last.alt && done.picks.length === 1)
    void snapPoints(done.picks, done.last.touch);
}

/** A second finger, or Escape: as if nothing had been pressed. */
function cancel() {
  box.value = null;
  if (drag) {
    cancelDrag(drag.before);
    if (drag.added) selection.value = [];
  }
  drag = null;
}

/** @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 @returns {Pick[]} */
function within(x0, y0, x1, y1) {
  return doc.value.observations.flatMap(({ feature, points }) =>
    points.flatMap((p, index) => {
      const [sx, sy] = toStage(...p);
      return typeof feature === "string" && sx >= x0 && sx <= x1 && sy >= y0 && sy <= y1
        ? [{ feature, index }]
        : [];
    }),
  );
}

/** @param {Pick} a @param {Pick} b */
const isSame = (a, b) => a.feature === b.feature && a.index === b.index;

export const pick = { down, move, up, cancel };
