// Actions at the desk of matched points: its own, and what shared ones mean there: add, move, select and remove
// matches, zoom and pan.
import { help } from "../../core/state.js";
import { t } from "../../core/words.js";
import { isOn } from "../../canvas/viewport.js";
import { nudgeOf } from "../calibrate/point_actions.js";
import {
  addMatchPoint,
  choose,
  chooseNext,
  chosenPoint,
  nudgeChosen,
  removeMatch,
} from "./matches.js";
import {
  atDesk,
  both,
  chosen,
  desk,
  members,
  pictures,
  pointed,
  side,
  takePictures,
  views,
} from "./match_desk.js";
import { worstMatch } from "./match_lines.js";
import { search } from "./rig.js";

const ZOOM = 1.25;

/** @type {import("../../core/actions.js").Action[]} */
export const MATCH_ACTIONS = [
  {
    id: "take-match-images",
    label: t("rig.match.action.take"),
    short: t("rig.match.take"),
    group: "pictures",
    run: () => void takePictures(),
    enabled: () => members.value !== null && search.value === null,
  },
  {
    id: "worst-match",
    label: t("rig.match.action.worst"),
    short: t("rig.match.action.worst.short"),
    keys: ["x"],
    group: "points",
    run: () => choose(worstMatch.value),
    enabled: () => atDesk.value && worstMatch.value >= 0,
  },
];

const hasMatches = () => desk.doc.value.matches.length > 0;
const here = () => views[side.value];
const hasPicture = () => pictures.value[side.value] !== null;

/**
 * By the action's id, in place of what it does elsewhere.
 * @type {Record<string, { run: (event?: KeyboardEvent) => void, enabled: () => boolean }>}
 */
const AT_DESK = {
  add: { run: addPoint, enabled: () => both.value },
  nudge: { run: nudge, enabled: hasPicture },
  "next-point": { run: () => chooseNext(1), enabled: hasMatches },
  "previous-point": { run: () => chooseNext(-1), enabled: hasMatches },
  delete: {
    run: () => {
      if (chosen.value) removeMatch(chosen.value.index);
    },
    enabled: () => chosen.value !== null,
  },
  undo: { run: desk.undo, enabled: () => desk.past.value.length > 0 },
  redo: { run: desk.redo, enabled: () => desk.future.value.length > 0 },
  "zoom-in": { run: () => here().zoomBy(ZOOM), enabled: hasPicture },
  "zoom-out": { run: () => here().zoomBy(1 / ZOOM), enabled: hasPicture },
  "zoom-fit": { run: () => here().fit(pictures.value[side.value]), enabled: hasPicture },
  escape: {
    run: () => {
      if (help.value) help.value = "";
      else chosen.value = null;
    },
    enabled: () => true,
  },
};

/**
 * The action, which at the desk acts on matches where the table above has it.
 * @param {import("../../core/actions.js").Action} action
 * @returns {import("../../core/actions.js").Action}
 */
export function actingOnMatches(action) {
  const there = AT_DESK[action.id];
  return there
    ? {
        ...action,
        run: (event) => (atDesk.value ? there : action).run(event),
        enabled: () => (atDesk.value ? there : action).enabled?.() ?? true,
      }
    : action;
}

/** Under the pointer, else in the middle of the image where the keys work. */
function addPoint() {
  const at = pointed.value?.touch ? null : pointed.value,
    s = at?.side ?? side.value,
    { width, height } = views[s].size.value;
  const isOnIt = at && isOn(pictures.value[s], at.x, at.y);
  addMatchPoint(s, isOnIt ? [at.x, at.y] : views[s].toPicture(width / 2, height / 2));
}

/** Move the chosen point, else pan. @param {KeyboardEvent} [event] */
function nudge(event) {
  const { step, pan } = nudgeOf(event);
  if (chosenPoint()) nudgeChosen(...step);
  else here().panBy(...pan);
}
