// What shared actions do while two cameras are compared: add, move, select and remove matches, zoom and pan.
import { worstMatch } from "./evaluation.js";
import { addMatchPoint, choose, chooseNext, chosenPoint, isOn, nudgeChosen, removeMatch } from "./matches.js";
import { atPair, both, chosen, pair, pictures, pointed, side, views } from "./pair.js";

const ZOOM = 1.25;

const hasMatches = () => pair.doc.value.matches.length > 0;
const here = () => views[side.value];
const hasPicture = () => pictures.value[side.value] !== null;

/**
 * By the action's id, in place of what it does elsewhere.
 * @type {Record<string, { run: () => void, enabled: () => boolean }>}
 */
const AT_PAIR = {
  add: { run: addPoint, enabled: () => both.value },
  "next-point": { run: () => chooseNext(1), enabled: hasMatches },
  "previous-point": { run: () => chooseNext(-1), enabled: hasMatches },
  delete: {
    run: () => {
      if (chosen.value) removeMatch(chosen.value.index);
    },
    enabled: () => chosen.value !== null,
  },
  undo: { run: pair.undo, enabled: () => pair.past.value.length > 0 },
  redo: { run: pair.redo, enabled: () => pair.future.value.length > 0 },
  "zoom-in": { run: () => here().zoomBy(ZOOM), enabled: hasPicture },
  "zoom-out": { run: () => here().zoomBy(1 / ZOOM), enabled: hasPicture },
  "zoom-fit": { run: () => here().fit(pictures.value[side.value]), enabled: hasPicture },
};

/**
 * The action, which at two cameras means matches where the table above has it.
 * @param {import("../../core/actions.js").Action} action
 * @returns {import("../../core/actions.js").Action}
 */
export function withPairActions(action) {
  const there = AT_PAIR[action.id];
  return there
    ? {
        ...action,
        run: (event) => (atPair.value ? there : action).run(event),
        enabled: () => (atPair.value ? there : action).enabled?.() ?? true,
      }
    : action;
}

/** Under the pointer, else in the middle of the picture where the keys work. */
function addPoint() {
  const at = pointed.value,
    s = at && !at.touch ? at.side : side.value,
    { width, height } = views[s].size.value;
  addMatchPoint(
    s,
    at && !at.touch && isOn(s, at.x, at.y) ? [at.x, at.y] : views[s].toPicture(width / 2, height / 2),
  );
}

/** @param {number[]} towards @param {number} size px @param {number} pan stage px, where no point is chosen */
export function pairArrow([dx, dy], size, pan) {
  if (chosenPoint()) nudgeChosen(dx * size, dy * size);
  else here().panBy(-dx * pan, -dy * pan);
}

export function showWorst() {
  if (worstMatch.value >= 0) choose(worstMatch.value);
}
