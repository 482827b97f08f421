// The match tool of one image of two: press on a mark to drag it, press beside one to click the next point.
import { isOn } from "../../canvas/viewport.js";
import { withClick, withMoved } from "./matches.js";
import { both, chosen, desk, pictures, side, views } from "./match_desk.js";

/** @typedef {import("./types").Side} Side @typedef {import("./types").MatchDoc} MatchDoc
 * @typedef {import("../../canvas/tools/pick.js").At} At */

const REACH_PX = 11,
  REACH_TOUCH_PX = 22; // how near a press must be to hold a point
const STILL_PX = 3; // a press that moves less is a click: hands shake

/** The nearest mark within reach, -1 where there is none. @param {Side} s @param {At} at */
function markAt(s, { x, y, touch }) {
  const away = desk.doc.value.matches.map((match) => {
      const [sx, sy] = match[s] ? views[s].toStage(...match[s]) : [Infinity, 0];
      return Math.hypot(sx - x, sy - y);
    }),
    nearest = Math.min(...away);
  return nearest < (touch ? REACH_TOUCH_PX : REACH_PX) ? away.indexOf(nearest) : -1;
}

/**
 * A press: start is the document as the drag begins; added, that its point is new.
 * @typedef {{ before: MatchDoc, start: MatchDoc, from: At, index: number, added: boolean, moved: boolean,
 *   chosenBefore: typeof chosen.value }} Drag
 */

/** @param {Side} s */
export function matchTool(s) {
  let drag = /** @type {Drag | null} */ (null);

  /** @param {At} at */
  function down(at) {
    const hit = markAt(s, at),
      before = desk.doc.value,
      chosenBefore = chosen.value,
      spot = views[s].toPicture(at.x, at.y);
    side.value = s;
    const added = hit < 0,
      { next: start, index } = added ? withClick(before, s, spot) : { next: before, index: hit };
    if (added && !(both.value && isOn(pictures.value[s], ...spot))) return;
    if (added) desk.showWhileDragging(start);
    chosen.value = { side: s, index };
    drag = { before, start, from: at, index, added, moved: false, chosenBefore };
  }

  /** @param {At} at */
  function move(at) {
    if (!drag || (!drag.moved && Math.hypot(at.x - drag.from.x, at.y - drag.from.y) < STILL_PX))
      return;
    drag.moved = true;
    const [x0, y0] = views[s].toPicture(drag.from.x, drag.from.y),
      [x, y] = views[s].toPicture(at.x, at.y);
    desk.showWhileDragging(withMoved(drag.start, s, drag.index, x - x0, y - y0));
  }

  function up() {
    if (drag && (drag.moved || drag.added)) desk.endDrag(drag.before);
    drag = null;
  }

  /** A second finger, or Escape: as if nothing had been pressed. */
  function cancel() {
    if (drag) {
      desk.cancelDrag(drag.before);
      chosen.value = drag.chosenBefore;
    }
    drag = null;
  }

  return { down, move, up, cancel };
}
