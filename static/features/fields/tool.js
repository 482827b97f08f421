// The pointer on a field that is edited: press on a handle or a marking to drag it, beside all to pan.
import { chosen, history, isShipped, viewport } from "./editor.js";
import { fieldPoint, mmPerStagePx } from "./frame.js";
import { apart, fromArc, fromLine, includes, withGripAt, withMoved } from "./geometry.js";
import { gripsOf, onGrid, snapped } from "./grips.js";

/**
 * @typedef {import("../../canvas/tools/pick.js").At} At
 * @typedef {import("../../core/types").Point} Point
 * @typedef {import("./types").FieldDoc} FieldDoc
 */

const REACH_PX = 9,
  REACH_TOUCH_PX = 20;
const STILL_PX = 3; // a press that moves less chooses
const SNAP_PX = 10;

/** start: the field as the drag begins. @type {{ start: FieldDoc, from: At, grip: import("./types").Grip | null,
 * isPan: boolean, moved: boolean } | null} */
let drag = null;

/** What is under a place, the nearest; landmarks lie on lines and come first.
 * @param {FieldDoc} doc @param {Point} p @param {number} reach mm @returns {import("./types").Mark | null} */
function markAt(doc, p, reach) {
  const spots = Object.entries(doc.landmarks).map(([name, at]) => ({
    mark: /** @type {import("./types").Mark} */ ({ kind: "landmark", name }),
    away: apart(at, p),
  }));
  const painted = [
    ...doc.lines
      .filter((l) => !l.off)
      .map((l) => ({ kind: "line", name: l.name, away: fromLine(p, l) })),
    ...doc.arcs
      .filter((a) => !a.off)
      .map((a) => ({ kind: "arc", name: a.name, away: fromArc(p, a) })),
  ].map(({ kind, name, away }) => ({
    mark: /** @type {import("./types").Mark} */ ({ kind, name }),
    away,
  }));
  const nearest = (/** @type {typeof spots} */ all, /** @type {number} */ within) =>
    all.filter(({ away }) => away < within).toSorted((a, b) => a.away - b.away)[0]?.mark;
  return nearest(spots, reach / 2) ?? nearest(painted, reach) ?? null;
}

/** @param {At} at */
function down(at) {
  const doc = history.doc.value;
  if (!doc) return;
  const p = fieldPoint(doc, viewport.toPicture(at.x, at.y)),
    reach = (at.touch ? REACH_TOUCH_PX : REACH_PX) * mmPerStagePx();
  const grip = isShipped.value
    ? undefined
    : chosen.value
        .flatMap((mark) => gripsOf(doc, mark))
        .filter((g) => apart(g.at, p) < reach)
        .toSorted((a, b) => apart(a.at, p) - apart(b.at, p))[0];
  const hit = grip?.mark ?? markAt(doc, p, reach);
  if (!grip && hit && !includes(chosen.value, hit))
    chosen.value = at.shift ? [...chosen.value, hit] : [hit];
  else if (!grip && hit && at.shift) chosen.value = chosen.value.filter((m) => !includes([hit], m));
  drag = { start: doc, from: at, grip: grip ?? null, isPan: !hit || isShipped.value, moved: false };
}

/** @param {At} at */
function move(at) {
  if (!drag || (!drag.moved && Math.hypot(at.x - drag.from.x, at.y - drag.from.y) < STILL_PX))
    return;
  drag.moved = true;
  if (drag.isPan) {
    viewport.panBy(at.x - drag.from.x, at.y - drag.from.y);
    drag.from = at;
    return;
  }
  const { start, grip } = drag,
    was = fieldPoint(start, viewport.toPicture(drag.from.x, drag.from.y)),
    is = fieldPoint(start, viewport.toPicture(at.x, at.y)),
    by = /** @type {Point} */ ([is[0] - was[0], is[1] - was[1]]);
  if (grip) {
    const to = /** @type {Point} */ ([grip.at[0] + by[0], grip.at[1] + by[1]]),
      place = snapped(start, to, SNAP_PX * mmPerStagePx(), grip.at);
    return history.showWhileDragging(withGripAt(start, grip, place, at.alt));
  }
  history.showWhileDragging(withMoved(start, chosen.value, [onGrid(by[0]), onGrid(by[1])], at.alt));
}

function up() {
  if (drag?.moved && !drag.isPan) history.endDrag(drag.start);
  else if (drag?.isPan && !drag.moved && !drag.from.shift) chosen.value = [];
  drag = null;
}

function cancel() {
  if (drag?.moved && !drag.isPan) history.cancelDrag(drag.start);
  drag = null;
}

export const editorTool = { down, move, up, cancel };
