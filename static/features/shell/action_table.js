// Everything an operator can do, in one table. Toolbar, shortcuts, the bright button and the list of keys read it.
import { arrows, canArrow, drawn, magnify, magnifyBy } from "../compare/residual_arrows.js";
import { automatic, findCaptured, look as looked, shown as captured, switchAutomatic, takeView, views } from "../board/capture.js";
import { form, keepCamera, shown as liveShown, status as liveStatus, confirmCamera, tried, tryCamera, trying } from "../live/camera_page.js";
import { AUTO_ACTIONS } from "../calibrate/find_lines.js";
import { CHECK_ACTIONS } from "../check/check.js";
import { TRACK_ACTIONS } from "../rig/tracks.js";
import { DRIFT_ACTIONS } from "../drift/drift.js";
import { atBoard, findLens, found, openBoard, ready, search, useLens } from "../board/board.js";
import { BORDERS, change, doc, future, past, pointsOf, redo, undo } from "../../core/document.js";
import { activateFeature, isOnPicture, nudge, remove, select, selectNext, withAdded } from "../calibrate/editing.js";
import { COMPARE_ACTIONS } from "../compare/actions.js";
import { record, sheet } from "../compare/comparison.js";
import { comparison, compareModels, ranking, stopComparing, useModel } from "../calibrate/model_ranking.js";
import { preview } from "../calibrate/fitting.js";
import { canHeat, differenceFrom, heat, others } from "../compare/heat.js";
import { chosen, openPair } from "../pair/pair.js";
import { backAddress, openPage, page } from "../../core/page.js";
import { AT_PAIR, pairArrow, showWorst } from "../pair/match_actions.js";
import { basis, bases, by, worst } from "../pair/evaluation.js";
import { closePicture, takePicture, watching } from "../calibrate/pictures.js";
import {
  active, atStraight, atPair, cameras, editing, help, picked, pointer, region, rotation, selection, showLines, snapshot, step, tool,
} from "../../core/state.js";
import { checkRig, makeRig, openNewRig, rig, search as rigSearch, stopRig } from "../rig/rig.js";
import { ROLL_ACTIONS } from "../rolling/actions.js";
import { SEEING_ACTIONS } from "../detection/actions.js";
import { SCENE_ACTIONS } from "../scene/actions.js";
import { SNAP_ACTIONS } from "../calibrate/snap_actions.js";
import { snapPoints, snapping } from "../calibrate/snapping.js";
import { discard, proposed } from "../calibrate/line_suggestions.js";
import { STEPS, nextThing, steps } from "./steps.js";
import { isOfThese, judge, openStraight, ready as withEdges, search as judging, showStraight, shown } from "../straight/straight.js";
import { leaveTour, takeTour, tour } from "../help/tour.js";
import { activate, isSaved, saveVersion, version } from "../versions/versions.js";
import { stageSize, toPicture } from "../../canvas/viewport.js";

/**
 * @typedef {object} Action
 * @property {string} id
 * @property {string} label what it does, beginning with a verb
 * @property {string} [short] the same on a small button
 * @property {string[]} [keys] as "p", "ctrl+z", "shift+ArrowUp"
 * @property {string} [group] heading in the list of keys
 * @property {(event?: KeyboardEvent) => void} run
 * @property {() => boolean} [enabled]
 * @property {() => boolean} [pressed] for buttons that stay down
 */

const ZOOM = 1.25;
const PAN_PX = 40;
const NUDGE_PX = 0.1, SHIFT_PX = 1, CTRL_PX = 10;
const STILL_FRAMES = 25;
const has = () => snapshot.value !== null;
const canZoom = () => has() || record.value !== null;
/** The picture's whole size, of a live one that of its calibration. */
const whole = () => snapshot.value ?? (record.value && { width: record.value.image_size[0], height: record.value.image_size[1] });
const isLive = () => liveStatus.value?.state === "live" || liveStatus.value?.state === "mismatch";

/** The page's one file input; a browser opens its picker only from a click. */
export const filePicker = { open: () => {} };

/** @type {Action[]} */
const TABLE = [
  { id: "open", label: "Open a picture…", keys: ["o"], group: "Pictures", run: () => filePicker.open() },
  { id: "take", label: "Take a new picture with the same camera", short: "Take a new picture", group: "Pictures",
    run: () => void takePicture(snapshot.value?.camera ?? cameras.value[0]?.id),
    enabled: () => Boolean(snapshot.value?.camera ?? cameras.value.length) },
  { id: "take-live", label: "Take a picture with this camera", short: "Take a picture", group: "Pictures", run: () => void takePicture(liveShown.value?.id ?? ""), enabled: () => isLive() },
  { id: "take-still", label: "Take the background of 25 frames, without people and robots that move", short: "Take it without what moves", group: "Pictures",
    run: () => void takePicture(liveShown.value?.id ?? "", STILL_FRAMES), enabled: () => isLive() },
  { id: "stop-watching", label: "Stop watching; nothing is kept", short: "Stop", group: "Pictures", run: () => watching.value?.stop.abort(), enabled: () => watching.value !== null },
  { id: "confirm-camera", label: "Confirm that it is the camera that was calibrated", group: "Pictures", run: () => void confirmCamera(), enabled: () => liveStatus.value?.problem?.reason === "other-camera" },
  { id: "try-camera", label: "Try this source", short: "Try it", group: "Pictures", run: () => void tryCamera(), enabled: () => Boolean(form.value?.values.source) && trying.value === null },
  { id: "keep-camera", label: "Keep this camera", group: "Pictures", run: () => void keepCamera(),
    enabled: () => Boolean(form.value?.values.id) && tried.value?.source === form.value?.values.source },
  { id: "board", label: "Calibrate a lens with a board…", group: "Pictures", run: () => { closePicture(); step.value = "camera"; void openBoard(); } },
  { id: "add-pictures", label: "Add pictures of the board…", group: "Pictures", run: () => filePicker.open(), enabled: () => atBoard.value },
  { id: "find-lens", label: "Find the lens from the pictures of the board", short: "Find the lens", group: "Pictures", run: () => void findLens(),
    enabled: () => atBoard.value && ready.value.length > 0 && search.value === null },
  { id: "stop-finding", label: "Stop finding the lens", short: "Stop", group: "Pictures", run: () => search.value?.stop.abort(), enabled: () => search.value !== null },
  { id: "use-lens", label: "Use this lens for a camera", group: "Pictures", run: () => { if (found.value) useLens(found.value); }, enabled: () => found.value !== null },
  { id: "jobs", label: "Show long work", keys: ["i"], group: "Pages", run: () => openPage("jobs") },
  { id: "versions", label: "Show all saved versions", keys: ["y"], group: "Pages", run: () => openPage("versions", snapshot.value?.camera ?? cameras.value[0]?.id ?? "") },
  { id: "settings", label: "Show the settings", group: "Pages", run: () => openPage("settings") },
  { id: "new-rig", label: "Make a rig of cameras that share a field…", short: "Make a rig…", group: "Pages", run: openNewRig },
  { id: "make-rig", label: "Make the rig", group: "Pages", run: () => void makeRig(), enabled: () => page.value?.name === "rig" },
  { id: "check-rig", label: "Check whether the rig's cameras agree", short: "Check the rig", group: "Pages", run: () => void checkRig(), enabled: () => rig.value !== null && rigSearch.value === null },
  { id: "stop-rig", label: "Stop the rig's work", short: "Stop", group: "Pages", run: stopRig, enabled: () => rigSearch.value !== null },
  { id: "back", label: "Go back from a page", short: "Back", group: "Pages", run: () => { location.hash = backAddress(); }, enabled: () => page.value !== null },
  { id: "watch-board", label: "Hold a board before this camera…", short: "Hold a board before it…", group: "Pictures", run: () => openPage("capture", liveShown.value?.id ?? ""), enabled: () => liveShown.value !== null },
  { id: "capture", label: "Take views of the board by themselves, or stop that", keys: ["k"], group: "Pictures", run: switchAutomatic, enabled: () => captured.value !== null, pressed: () => automatic.value },
  { id: "take-view", label: "Take this view of the board", short: "Take this view", keys: [" "], group: "Pictures", run: takeView, enabled: () => Boolean(looked.value?.quad) },
  { id: "find-captured", label: "Find the lens from the views of the board", short: "Find the lens", group: "Pictures", run: () => void findCaptured(), enabled: () => views.value.length >= 3 },
  { id: "pair", label: "Compare two cameras…", group: "Pictures", run: () => { closePicture(); step.value = "camera"; void openPair(); } },
  { id: "worst-match", label: "Show the worst match of two cameras", short: "Show the worst", keys: ["x"], group: "Points", run: showWorst,
    enabled: () => atPair.value && worst.value >= 0 },
  { id: "pair-lines", label: "Switch epipolar lines between matches and calibrations", short: "Lines", group: "View", keys: ["s"],
    run: () => { basis.value = by.value === "matches" ? "calibrations" : "matches"; },
    enabled: () => atPair.value && bases.value.matches !== null && bases.value.calibrations !== null },
  { id: "straight", label: "Check a lens by straight edges…", group: "Pictures", run: () => { closePicture(); step.value = "camera"; void openStraight(); } },
  { id: "add-edges", label: "Add pictures of straight edges…", short: "Add pictures…", group: "Pictures", run: () => filePicker.open(), enabled: () => atStraight.value },
  { id: "judge-edges", label: "Judge how straight the edges are", short: "Judge the edges", group: "Pictures", run: () => void judge(),
    enabled: () => atStraight.value && withEdges.value.length > 0 && judging.value === null },
  { id: "stop-judging", label: "Stop judging the edges", short: "Stop", group: "Pictures", run: () => judging.value?.stop.abort(), enabled: () => judging.value !== null },
  { id: "straighten", label: "Show the picture straightened, or as taken", group: "Pictures", run: () => showStraight(!shown.value.straight), enabled: () => isOfThese.value },
  { id: "turn", label: "Turn the field a quarter", short: "Turn a quarter", keys: ["t"], group: "Pictures",
    run: () => change({ ...doc.value, rotate: (rotation.value + 90) % 360 }), enabled: () => region.value !== null },

  ...SEEING_ACTIONS,
  { id: "pick", label: "Pick points", short: "Pick", keys: ["p"], group: "Points", run: () => { tool.value = "pick"; },
    pressed: () => tool.value === "pick" },
  ...BORDERS.map((border, i) => ({
    id: `border-${border}`, label: `Click the ${border} border`, keys: [String(i + 1)], group: "Points",
    run: () => activateFeature(border), enabled: () => editing.value, pressed: () => active.value === border,
  })),
  { id: "add", label: "Add a point under the pointer, or in the middle", keys: ["a"], group: "Points", run: addPoint,
    enabled: () => editing.value },
  { id: "nudge", label: "Move the point by 0.1 px; with Shift 1 px, with Ctrl 10 px", group: "Points", run: arrow,
    keys: ["", "shift+", "ctrl+"].flatMap((m) => ["Left", "Right", "Up", "Down"].map((d) => `${m}Arrow${d}`)), enabled: () => canZoom() || atPair.value },
  { id: "next-point", label: "Select the next point (on the picture also Tab)", keys: ["n"], group: "Points", run: () => void selectNext(1, true), enabled: () => editing.value },
  { id: "previous-point", label: "Select the previous point", keys: ["b"], group: "Points", run: () => void selectNext(-1, true), enabled: () => editing.value },
  { id: "select-all", label: "Select all points of this line", keys: ["ctrl+a"], group: "Points", enabled: () => editing.value,
    run: () => { selection.value = pointsOf(doc.value, active.value).map((_, index) => ({ feature: active.value, index })); } },
  { id: "delete", label: "Remove the selected points", short: "Remove", keys: ["Delete", "Backspace"], group: "Points",
    run: () => remove(picked.value), enabled: () => editing.value && picked.value.length > 0 },
  { id: "clear", label: "Remove all points of this line", short: "Clear", group: "Points",
    run: () => remove(pointsOf(doc.value, active.value).map((_, index) => ({ feature: active.value, index }))),
    enabled: () => editing.value && pointsOf(doc.value, active.value).length > 0 },
  ...SNAP_ACTIONS,
  ...SCENE_ACTIONS, ...ROLL_ACTIONS,
  ...AUTO_ACTIONS,
  ...CHECK_ACTIONS,
  ...TRACK_ACTIONS,
  ...DRIFT_ACTIONS,
  { id: "undo", label: "Undo", keys: ["ctrl+z"], group: "Points", run: undo, enabled: () => past.value.length > 0 },
  { id: "redo", label: "Redo", keys: ["ctrl+y", "ctrl+shift+z"], group: "Points", run: redo, enabled: () => future.value.length > 0 },

  { id: "pan", label: "Pan the picture", short: "Pan", keys: ["h"], group: "View", run: () => { tool.value = "pan"; },
    pressed: () => tool.value === "pan" },
  { id: "zoom-in", label: "Zoom in", short: "+", keys: ["+", "="], group: "View", run: () => sheet.value.zoomBy(ZOOM), enabled: canZoom },
  { id: "zoom-out", label: "Zoom out", short: "−", keys: ["-"], group: "View", run: () => sheet.value.zoomBy(1 / ZOOM), enabled: canZoom },
  { id: "zoom-fit", label: "Show the whole picture", short: "Fit", keys: ["0"], group: "View", run: () => sheet.value.fit(whole()), enabled: canZoom },
  { id: "lines", label: "Draw the field's lines on the picture", short: "Lines", keys: ["l"], group: "View",
    run: () => { showLines.value = !showLines.value; }, pressed: () => showLines.value,
    enabled: () => preview.value !== null || version.value !== null },
  ...COMPARE_ACTIONS,
  { id: "heat", label: "Show the expected error over the field", short: "Error", keys: ["e"], group: "View",
    run: () => { heat.value = { ...heat.value, what: heat.value.what === "expected" ? "none" : "expected" }; },
    pressed: () => heat.value.what === "expected", enabled: () => canHeat.value },
  { id: "heat-height", label: "Switch the expected error between carpet and hat height", short: "Hat height", keys: ["z"], group: "View",
    run: () => { heat.value = { ...heat.value, atHats: !heat.value.atHats }; },
    pressed: () => heat.value.atHats, enabled: () => canHeat.value && heat.value.what === "expected" },
  { id: "arrows", label: "Show residuals as arrows, to where the model puts each click", short: "Arrows", keys: ["v"], group: "View",
    run: () => { arrows.value = { ...arrows.value, on: !arrows.value.on }; }, pressed: () => arrows.value.on, enabled: () => canArrow.value },
  { id: "arrows-longer", label: "Magnify the arrows more", keys: ["."], group: "View", run: () => magnifyBy(1), enabled: () => drawn.value !== null },
  { id: "arrows-shorter", label: "Magnify the arrows less", keys: [","], group: "View", run: () => magnifyBy(-1), enabled: () => drawn.value !== null },
  { id: "arrows-auto", label: "Magnify the arrows so that they can be read", group: "View", run: () => magnify(null), enabled: () => drawn.value !== null },
  { id: "difference", label: "Show the difference from another version", short: "Choose a version…", keys: ["d"], group: "View",
    run: () => { if (heat.value.what === "difference") heat.value = { ...heat.value, what: "none" }; else differenceFrom(); },
    pressed: () => heat.value.what === "difference", enabled: () => canHeat.value && others.value.length > 0 },

  { id: "compare-models", label: "Compare the models on these clicks", short: "Compare the models", group: "Model", run: compareModels,
    enabled: () => editing.value && preview.value !== null && comparison.value === null },
  { id: "stop-comparing", label: "Stop comparing the models", short: "Stop", group: "Model", run: stopComparing, enabled: () => comparison.value !== null },
  { id: "use-recommended", label: "Use the recommended model", keys: ["m"], group: "Model", run: () => useModel(ranking.value?.recommended ?? ""),
    enabled: () => step.value === "model" && Boolean(ranking.value?.recommended) },

  ...STEPS.map(({ id, label }) => ({
    id: `step-${id}`, label: `Go to ${label.toLowerCase()}`, run: () => { step.value = id; },
    enabled: () => steps.value.find((s) => s.id === id)?.open ?? false,
  })),
  { id: "next", label: "Do the next thing (the bright button)", keys: ["Enter"], group: "Steps",
    run: () => run(nextThing.value.action), enabled: () => !nextThing.value.missing },
  { id: "save", label: "Save a version and compare", short: "Save and compare", keys: ["ctrl+s"], group: "Steps", run: () => void saveVersion(),
    enabled: () => has() && doc.value.observations.length > 0 }, // if something is missing, the server says what
  { id: "activate", label: "Activate this version for its camera", short: "Activate", group: "Steps",
    run: () => void (version.value && activate(version.value.id)), enabled: () => isSaved.value && !version.value?.active },

  { id: "keys", label: "Show the keys", short: "?", keys: ["?"], group: "Help", run: () => { help.value = help.value === "keys" ? "" : "keys"; } },
  { id: "manual", label: "Open the manual", short: "Manual", keys: ["F1"], group: "Help", run: () => { help.value = help.value === "manual" ? "" : "manual"; } },
  { id: "tour", label: "Take the tour, or leave it", short: "Tour", keys: ["F2"], group: "Help", run: () => { if (tour.value.on) leaveTour(); else takeTour(); } },
  { id: "escape", label: "Close help, or deselect", keys: ["Escape"], group: "Help",
    run: () => { if (proposed.value) discard(); else if (help.value) help.value = ""; else { selection.value = []; chosen.value = null; } } },
];

/** @type {Map<string, Action>} */
export const ACTIONS = new Map(TABLE.map((action) => [action.id, orAtPair(action)]));

/** At two cameras some actions mean matches. @param {Action} action @returns {Action} */
function orAtPair(action) {
  const there = AT_PAIR[action.id];
  return there ? { ...action, run: (event) => (atPair.value ? there : action).run(event), enabled: () => (atPair.value ? there : action).enabled?.() ?? true } : action;
}

/** Do it, if it can be done now. @param {string} id @param {KeyboardEvent} [event] */
export function run(id, event) {
  const action = ACTIONS.get(id);
  if (action && (action.enabled?.() ?? true)) action.run(event);
}

function addPoint() {
  const at = pointer.value, { width, height } = stageSize.value;
  const [x, y] = at && !at.touch && isOnPicture(at.x, at.y) ? [at.x, at.y] : toPicture(width / 2, height / 2);
  const { next, pick } = withAdded(doc.value, active.value, x, y);
  change(next);
  select([pick]);
  if (snapping.value) void snapPoints([pick]);
}

/** @param {KeyboardEvent} [event] */
function arrow(event) {
  const towards = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event?.key ?? ""];
  if (!event || !towards) return;
  const size = event.shiftKey ? SHIFT_PX : event.ctrlKey || event.metaKey ? CTRL_PX : NUDGE_PX;
  if (atPair.value) pairArrow(towards, size, PAN_PX);
  else if (editing.value && picked.value.length) {
    nudge(towards[0] * size, towards[1] * size);
  } else sheet.value.panBy(-towards[0] * PAN_PX, -towards[1] * PAN_PX);
}
