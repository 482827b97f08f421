// Actions on clicked points: choose a border, add, move, select and remove points, undo and redo.
import { BORDERS, change, doc, future, past, pointsOf, redo, undo } from "../../core/document.js";
import { lineName } from "../../core/format.js";
import { active, editing, pointer, selectedPoints, selection, tool } from "../../core/state.js";
import { t } from "../../core/words.js";
import { stageSize, toPicture } from "../../canvas/viewport.js";
import { activeViewport } from "../compare/comparison.js";
import {
  activateFeature,
  isOnPicture,
  nudge,
  remove,
  select,
  selectNext,
  withAdded,
} from "./editing.js";
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
    label: t("calibrate.point-actions.pick"),
    short: t("calibrate.point-actions.pick.short"),
    keys: ["p"],
    group: "points",
    run: () => {
      tool.value = "pick";
    },
    pressed: () => tool.value === "pick",
  },
  ...BORDERS.map((border, i) => ({
    id: `border-${border}`,
    label: t("calibrate.click", { feature: lineName(border) }),
    keys: [String(i + 1)],
    group: /** @type {const} */ ("points"),
    run: () => activateFeature(border),
    enabled: () => editing.value,
    pressed: () => active.value === border,
  })),
  {
    id: "add",
    label: t("calibrate.point-actions.add"),
    keys: ["a"],
    group: "points",
    run: addPoint,
    enabled: () => editing.value,
  },
  {
    id: "nudge",
    label: t("calibrate.point-actions.nudge"),
    group: "points",
    run: arrow,
    keys: ["", "shift+", "ctrl+"].flatMap((m) =>
      ["Left", "Right", "Up", "Down"].map((d) => `${m}Arrow${d}`),
    ),
    enabled: canZoom,
  },
  {
    id: "next-point",
    label: t("calibrate.point-actions.next"),
    keys: ["n"],
    group: "points",
    run: () => void selectNext(1, true),
    enabled: () => editing.value,
  },
  {
    id: "previous-point",
    label: t("calibrate.point-actions.previous"),
    keys: ["b"],
    group: "points",
    run: () => void selectNext(-1, true),
    enabled: () => editing.value,
  },
  {
    id: "select-all",
    label: t("calibrate.point-actions.select-all"),
    keys: ["ctrl+a"],
    group: "points",
    enabled: () => editing.value,
    run: () => {
      selection.value = pointsOf(doc.value, active.value).map((_, index) => ({
        feature: active.value,
        index,
      }));
    },
  },
  {
    id: "delete",
    label: t("calibrate.point-actions.remove"),
    short: t("calibrate.point-actions.remove.short"),
    keys: ["Delete", "Backspace"],
    group: "points",
    run: () => remove(selectedPoints.value),
    enabled: () => editing.value && selectedPoints.value.length > 0,
  },
  {
    id: "clear",
    label: t("calibrate.point-actions.clear"),
    short: t("calibrate.point-actions.clear.short"),
    group: "points",
    run: () =>
      remove(
        pointsOf(doc.value, active.value).map((_, index) => ({ feature: active.value, index })),
      ),
    enabled: () => editing.value && pointsOf(doc.value, active.value).length > 0,
  },
];

/** @type {import("../../core/actions.js").Action[]} */
export const HISTORY_ACTIONS = [
  {
    id: "undo",
    label: t("common.undo"),
    keys: ["ctrl+z"],
    group: "points",
    run: undo,
    enabled: () => past.value.length > 0,
  },
  {
    id: "redo",
    label: t("common.redo"),
    keys: ["ctrl+y", "ctrl+shift+z"],
    group: "points",
    run: redo,
    enabled: () => future.value.length > 0,
  },
];

function addPoint() {
  const at = pointer.value,
    { width, height } = stageSize.value;
  const [x, y] =
    at && !at.touch && isOnPicture(at.x, at.y) ? [at.x, at.y] : toPicture(width / 2, height / 2);
  const { next, pick } = withAdded(doc.value, active.value, x, y);
  change(next);
  select([pick]);
  if (snapping.value) void snapPoints([pick]);
}

/**
 * What an arrow key asks for: how far a point moves, px, and how far the view pans, stage px.
 * @param {KeyboardEvent} [event]
 * @returns {Record<"step" | "pan", [number, number]>}
 */
export function nudgeOf(event) {
  const towards = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] },
    [dx, dy] = towards[/** @type {keyof typeof towards} */ (event?.key)] ?? [0, 0],
    size = event?.shiftKey ? SHIFT_PX : event?.ctrlKey || event?.metaKey ? CTRL_PX : NUDGE_PX;
  return { step: [dx * size, dy * size], pan: [-dx * PAN_PX, -dy * PAN_PX] };
}

/** @param {KeyboardEvent} [event] */
function arrow(event) {
  const { step, pan } = nudgeOf(event);
  if (editing.value && selectedPoints.value.length) nudge(...step);
  else activeViewport.value.panBy(...pan);
}
