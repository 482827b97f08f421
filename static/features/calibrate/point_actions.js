// Actions on clicked points: choose a border, add, move, select and remove points, undo and redo.
import { BORDERS, change, doc, future, past, pointsOf, redo, undo } from "../../core/document.js";
import { active, editing, pointer, selectedPoints, selection, tool } from "../../core/state.js";
import { stageSize, toPicture } from "../../canvas/viewport.js";
import { activeViewport } from "../compare/comparison.js";
import { pairArrow } from "../pair/match_actions.js";
import { atPair } from "../pair/pair.js";
import { activateFeature, isOnPicture, nudge, remove, select, selectNext, withAdded } from "./editing.js";
import { snapPoints, snapping } from "./snapping.js";
import { canZoom } from "./view_actions.js";

const PAN_PX = 40;
const NUDGE_PX = 0.1,
  SHIFT_PX = 1,
  CTRL_PX = 10;

/** @type {import("../../core/actions.js").Action[]} */
export const POINT_ACTIONS = [
  {
    id: "pick",
    label: "Pick points",
    short: "Pick",
    keys: ["p"],
    group: "Points",
    run: () => {
      tool.value = "pick";
    },
    pressed: () => tool.value === "pick",
  },
  ...BORDERS.map((border, i) => ({
    id: `border-${border}`,
    label: `Click the ${border} border`,
    keys: [String(i + 1)],
    group: "Points",
    run: () => activateFeature(border),
    enabled: () => editing.value,
    pressed: () => active.value === border,
  })),
  {
    id: "add",
    label: "Add a point under the pointer, or in the middle",
    keys: ["a"],
    group: "Points",
    run: addPoint,
    enabled: () => editing.value,
  },
  {
    id: "nudge",
    label: "Move the point by 0.1 px; with Shift 1 px, with Ctrl 10 px",
    group: "Points",
    run: arrow,
    keys: ["", "shift+", "ctrl+"].flatMap((m) => ["Left", "Right", "Up", "Down"].map((d) => `${m}Arrow${d}`)),
    enabled: () => canZoom() || atPair.value,
  },
  {
    id: "next-point",
    label: "Select the next point (on the picture also Tab)",
    keys: ["n"],
    group: "Points",
    run: () => void selectNext(1, true),
    enabled: () => editing.value,
  },
  {
    id: "previous-point",
    label: "Select the previous point",
    keys: ["b"],
    group: "Points",
    run: () => void selectNext(-1, true),
    enabled: () => editing.value,
  },
  {
    id: "select-all",
    label: "Select all points of this line",
    keys: ["ctrl+a"],
    group: "Points",
    enabled: () => editing.value,
    run: () => {
      selection.value = pointsOf(doc.value, active.value).map((_, index) => ({ feature: active.value, index }));
    },
  },
  {
    id: "delete",
    label: "Remove the selected points",
    short: "Remove",
    keys: ["Delete", "Backspace"],
    group: "Points",
    run: () => remove(selectedPoints.value),
    enabled: () => editing.value && selectedPoints.value.length > 0,
  },
  {
    id: "clear",
    label: "Remove all points of this line",
    short: "Clear",
    group: "Points",
    run: () => remove(pointsOf(doc.value, active.value).map((_, index) => ({ feature: active.value, index }))),
    enabled: () => editing.value && pointsOf(doc.value, active.value).length > 0,
  },
];

/** @type {import("../../core/actions.js").Action[]} */
export const HISTORY_ACTIONS = [
  {
    id: "undo",
    label: "Undo",
    keys: ["ctrl+z"],
    group: "Points",
    run: undo,
    enabled: () => past.value.length > 0,
  },
  {
    id: "redo",
    label: "Redo",
    keys: ["ctrl+y", "ctrl+shift+z"],
    group: "Points",
    run: redo,
    enabled: () => future.value.length > 0,
  },
];

function addPoint() {
  const at = pointer.value,
    { width, height } = stageSize.value;
  const [x, y] = at && !at.touch && isOnPicture(at.x, at.y) ? [at.x, at.y] : toPicture(width / 2, height / 2);
  const { next, pick } = withAdded(doc.value, active.value, x, y);
  change(next);
  select([pick]);
  if (snapping.value) void snapPoints([pick]);
}

/** @param {KeyboardEvent} [event] */
function arrow(event) {
  const towards = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[
    event?.key ?? ""
  ];
  if (!event || !towards) return;
  const size = event.shiftKey ? SHIFT_PX : event.ctrlKey || event.metaKey ? CTRL_PX : NUDGE_PX;
  if (atPair.value) pairArrow(towards, size, PAN_PX);
  else if (editing.value && selectedPoints.value.length) {
    nudge(towards[0] * size, towards[1] * size);
  } else activeViewport.value.panBy(-towards[0] * PAN_PX, -towards[1] * PAN_PX);
}
