// The operator's document (field, region, model, clicks) and its history. Undo is an earlier copy.
import { createHistory, isEqual } from "./history.js";

export { isEqual };

/**
 * @typedef {import("./types").Doc} Doc
 * @typedef {import("./types").Border} Border
 * @typedef {import("./types").Point} Point
 */

/** @type {Border[]} */
export const BORDERS = ["left", "right", "top", "bottom"];

/** @type {Doc} */
export const EMPTY = {
  field: null,
  region: null,
  rotate: null,
  model: null, // automatic: the server chooses
  options: {},
  observations: [],
};

export const {
  doc,
  past,
  future,
  dragging,
  change,
  showWhileDragging,
  endDrag,
  cancelDrag,
  undo,
  redo,
  load,
} = createHistory(EMPTY);

/** @param {Doc} document @param {string} feature @returns {Point[]} */
export function pointsOf(document, feature) {
  return document.observations.find((o) => o.feature === feature)?.points ?? [];
}

/** The document with a feature's points replaced; none removes it.
 * @param {Doc} document @param {string} feature @param {Point[]} points @param {"line" | "landmark"} kind @returns
 * {Doc} */
export function withPoints(document, feature, points, kind) {
  const others = document.observations.filter((o) => o.feature !== feature);
  const own = points.length ? [{ feature, kind, points }] : [];
  // Borders first and in one order, so that the same clicks make the same document.
  return { ...document, observations: [...others, ...own].toSorted((a, b) => rank(a) - rank(b)) };
}

/** The document with another model. Options that mean the same to both stay, but for a lens, which is of one model.
 * @param {Doc} document @param {import("./types").Model} next @param {import("./types").Model | null} before @returns
 * {Doc} */
export function withModel(document, next, before) {
  const lenses = new Set(
    next.options
      .filter((o) => o.type === "calibration")
      .flatMap(({ name }) => [name, `${name}_sigma`]),
  );
  const kept = next.options.filter(
    (o) =>
      before?.options.some((b) => isEqual(b, o)) &&
      !lenses.has(o.name) &&
      o.name in document.options,
  );
  return {
    ...document,
    model: next.name,
    options: Object.fromEntries(kept.map(({ name }) => [name, document.options[name]])),
  };
}

/** What is true of the camera, its clicks and its picture, whichever model describes it. */
export const FACTS = ["height_mm", "line_sigma_mm", "click_sigma_px"];
const OF_ANY_MODEL = new Set([
  ...FACTS,
  "w_max_rectangle_px",
  "h_max_rectangle_px",
  "n_rectangles_x",
  "n_rectangles_y",
]);

/** The document with the model left to the server. @param {Doc} document @returns {Doc} */
export const withAutomaticModel = (document) => ({
  ...document,
  model: null,
  options: Object.fromEntries(
    Object.entries(document.options).filter(([name]) => OF_ANY_MODEL.has(name)),
  ),
});

/** @param {import("./types").Observation} o */
function rank(o) {
  const at = BORDERS.indexOf(/** @type {Border} */ (o.feature));
  return at < 0 ? BORDERS.length : at;
}

/** A draft as the server keeps it, as a document. @param {Record<string, any>} draft @returns {Doc} */
export const fromDraft = (draft) => ({
  field: draft.field ?? null,
  region: draft.region ?? null,
  rotate: draft.rotate ?? null,
  model: draft.model || null,
  options: draft.options ?? {},
  // On the carpet is what no height means: one form, so that equal drafts are equal text.
  observations: (draft.observations ?? []).map(
    (/** @type {import("./types").Observation} */ { feature, kind, points, z_mm }) =>
      z_mm ? { feature, kind, points, z_mm } : { feature, kind, points },
  ),
});
