// The operator's document (field, region, model, clicks) and its history. Undo is an earlier copy.
import { batch, signal } from "@preact/signals";

/** @typedef {import("./types").Doc} Doc @typedef {import("./types").Border} Border @typedef {import("./types").Point} Point */

/** @type {Border[]} */
export const BORDERS = ["left", "right", "top", "bottom"];
const MAX_HISTORY = 500; // copies of a few kB each

/** @type {Doc} */
export const EMPTY = { field: null, region: null, rotate: null, model: "polynomial", options: {}, observations: [] };

export const doc = signal(EMPTY);
export const past = signal(/** @type {Doc[]} */ ([]));
export const future = signal(/** @type {Doc[]} */ ([]));
/** True while a point is held: previews and saving wait for its release. */
export const dragging = signal(false);

/** One change that can be undone. @param {Doc} next */
export function change(next) {
  if (same(next, doc.value)) return;
  past.value = [...past.value.slice(-MAX_HISTORY), doc.value];
  future.value = [];
  doc.value = next;
}

/** Show the document as it will be once a drag ends. @param {Doc} next */
export function showWhileDragging(next) {
  dragging.value = true;
  doc.value = next;
}

/** End of a drag: all of it becomes one change. @param {Doc} before */
export function endDrag(before) {
  const after = doc.value;
  batch(() => { // nobody sees the document jump back for a moment
    doc.value = before;
    change(after);
    dragging.value = false;
  });
}

/** Forget a drag. @param {Doc} before */
export function cancelDrag(before) {
  doc.value = before;
  dragging.value = false;
}

export function undo() {
  const before = past.value.at(-1);
  if (!before) return;
  future.value = [doc.value, ...future.value];
  past.value = past.value.slice(0, -1);
  doc.value = before;
}

export function redo() {
  const [after, ...rest] = future.value;
  if (!after) return;
  past.value = [...past.value, doc.value];
  future.value = rest;
  doc.value = after;
}

/** Start afresh, without history. @param {Doc} next */
export function load(next) {
  past.value = [];
  future.value = [];
  dragging.value = false;
  doc.value = next;
}

/** @param {Doc} document @param {string} feature @returns {Point[]} */
export function pointsOf(document, feature) {
  return document.observations.find((o) => o.feature === feature)?.points ?? [];
}

/** The document with a feature's points replaced; none removes it.
 * @param {Doc} document @param {string} feature @param {Point[]} points @param {"line" | "landmark"} kind @returns {Doc} */
export function withPoints(document, feature, points, kind) {
  const others = document.observations.filter((o) => o.feature !== feature);
  const own = points.length ? [{ feature, kind, points }] : [];
  // Borders first and in one order, so that the same clicks make the same document.
  return { ...document, observations: [...others, ...own].toSorted((a, b) => rank(a) - rank(b)) };
}

/** The document with another model. Options that mean the same to both stay, but for a lens, which is of one model.
 * @param {Doc} document @param {import("./types").Model} next @param {import("./types").Model | null} before @returns {Doc} */
export function withModel(document, next, before) {
  const lenses = new Set(next.options.filter((o) => o.type === "calibration").flatMap(({ name }) => [name, `${name}_sigma`]));
  const kept = next.options.filter((o) => before?.options.some((b) => same(b, o)) && !lenses.has(o.name) && o.name in document.options);
  return { ...document, model: next.name, options: Object.fromEntries(kept.map(({ name }) => [name, document.options[name]])) };
}

/** @param {import("./types").Observation} o */
function rank(o) {
  const at = BORDERS.indexOf(/** @type {Border} */ (o.feature));
  return at < 0 ? BORDERS.length : at;
}

/** @param {unknown} a @param {unknown} b */
export const same = (a, b) => a === b || JSON.stringify(a) === JSON.stringify(b);

/** A draft as the server keeps it, as a document. @param {Record<string, any>} draft @returns {Doc} */
export const fromDraft = (draft) => ({
  field: draft.field ?? null, region: draft.region ?? null, rotate: draft.rotate ?? null,
  model: draft.model || EMPTY.model, options: draft.options ?? {},
  // On the carpet is what no height means: one form, so that equal drafts are equal text.
  observations: (draft.observations ?? []).map((/** @type {import("./types").Observation} */ { feature, kind, points, z_mm }) =>
    (z_mm ? { feature, kind, points, z_mm } : { feature, kind, points })),
});
