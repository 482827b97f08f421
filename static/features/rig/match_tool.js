// The match tool of one image of two: press on a mark to drag it, press beside one to click the next point.
import { isOn, withClick, withMoved } from "./matches.js";
import { both, chosen, desk, side, views } from "./match_desk.js";

/** @typedef {import("./types").Side} Side @typedef {import("../../canvas/tools/pick.js").At} At */

const REACH_PX = 11,
  REACH_TOUCH_PX = 22; // how near a press must be to hold a point
const STILL_PX = 3; // a press that moves less is a click: hands shake

/** The mark within reach, the nearest one. @param {Side} s @param {At} at */
function markAt(s, { x, y, touch }) {
  let best = -1,
    nearest = touch ? REACH_TOUCH_PX : REACH_PX;
  desk.doc.value.matches.forEach((match, index) => {
    const point = match[s];
    if (!point) return;
    const [sx, sy] = views[s].toStage(...point),
      away = Math.hypot(sx - x, sy - y);
    if (away < nearest) {
      best = index;
      nearest = away;
    }
  });
  return best;
}

/** @param {Side} s */
export function matchTool(s) {
  /** start: the document as the drag begins; added: a point that is new */
  let drag =
    /**
     * @type {{ before: import("./types").MatchDoc, start: import("./types").MatchDoc, from: At, index: number, added:
     *   boolean, moved: boolean, chosenBefore: typeof chosen.value } | null}
     */ (
      null
    );

  /** @param {At} at */
  function down(at) {
    const hit = markAt(s, at),
      before = desk.doc.value,
      chosenBefore = chosen.value,
      spot = views[s].toPicture(at.x, at.y);
    side.value = s;
    if (hit >= 0) {
      chosen.value = { side: s, index: hit };
      drag = { before, start: before, from: at, index: hit, added: false, moved: false, chosenBefore };
    } else if (both.value && isOn(s, ...spot)) {
      const { next, index } = withClick(before, s, ...spot);
      desk.showWhileDragging(next);
      chosen.value = { side: s, index };
      drag = { before, start: next, from: at, index, added: true, moved: false, chosenBefore };
    }
  }

  /** @param {At} at */
  function move(at) {
    if (!drag || (!drag.moved && Math.hypot(at.x - drag.from.x, at.y - drag.from.y) < STILL_PX)) return;
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
