// Suggested lines: the field's lines as the present fit predicts them, clickable by pointing at them, and points
// proposed along one.
import { computed, effect, signal, untracked } from "@preact/signals";
import { call } from "../../core/api.js";
import { BORDERS, change, doc, pointsOf, withPoints } from "../../core/document.js";
import { lineName } from "../../core/format.js";
import {
  active,
  editing,
  kindOf,
  notifyError,
  pointer,
  selection,
  snapshot,
  tool,
} from "../../core/state.js";
import { t } from "../../core/words.js";
import { view } from "../../canvas/viewport.js";
import { lineUnder } from "./field_sides.js";
import { givenFit, preview, refusal } from "./fitting.js";
import { saySnapped, snapping } from "./snapping.js";

/** @typedef {import("../../core/types").Point} Point */

const REACH_PX = 9,
  REACH_TOUCH_PX = 20; // on the stage: how near a line a press means it
const OWN = 2; // of that, within which the line that is being clicked keeps its clicks
const SPARE_PX = 5; // of the picture: a proposal so near a point that stands would say it twice
const WANTED = 9;

/** Every line and arc that the fit sees in the picture, once: a border and the line painted under it are one. */
export const suggestedLines = computed(() => {
  if (!editing.value || refusal.value || !preview.value) return [];
  const twice = new Set(BORDERS.map(lineUnder));
  return preview.value.overlay.filter(
    (f) => f.kind !== "landmark" && f.points.length > 1 && !twice.has(f.feature),
  );
});

/** @typedef {{ feature: string, points: Point[] }} Proposal */

/**
 * Points that nobody has accepted yet: found along one line, or detected where the detection is not sure of them.
 * along: they belong to the line that is active.
 */
export const proposals = signal(
  /** @type {{ along: boolean, items: Proposal[] }} */ ({ along: true, items: [] }),
);
/** Those that can still be accepted: a detected line that was accepted is offered again when that is undone. */
export const offered = computed(() =>
  proposals.value.items.filter(
    (it) => proposals.value.along || !pointsOf(doc.value, it.feature).length,
  ),
);

/** px of the stage from a place to a drawn line. @param {Point} at picture px @param {(Point | null)[]} points */
function away([x, y], points) {
  let nearest = Infinity;
  for (let i = 1; i < points.length; i++) {
    const a = points[i - 1],
      b = points[i];
    if (!a || !b) continue;
    const dx = b[0] - a[0],
      dy = b[1] - a[1],
      long = dx * dx + dy * dy;
    const share = long ? Math.min(1, Math.max(0, ((x - a[0]) * dx + (y - a[1]) * dy) / long)) : 0;
    nearest = Math.min(nearest, Math.hypot(a[0] + share * dx - x, a[1] + share * dy - y));
  }
  return nearest * view.value.k;
}

/**
 * Which line a click there lies on: the active one, unless it is plainly on another.
 * @param {Point} at picture px
 * @param {boolean} touch
 */
export function featureAt(at, touch) {
  if (!snapping.value) return active.value;
  const reach = touch ? REACH_TOUCH_PX : REACH_PX;
  const own = suggestedLines.value.find((f) => f.feature === active.value);
  if (kindOf(active.value) === "landmark" || (own && away(at, own.points) < OWN * reach))
    return active.value;
  let best = active.value,
    nearest = reach;
  for (const { feature, points } of suggestedLines.value) {
    const px = away(at, points);
    if (px < nearest) {
      best = feature;
      nearest = px;
    }
  }
  return best;
}

/** The line under the pointer, which a click would go to. */
export const lineUnderPointer = computed(() => {
  const at = pointer.value;
  if (!at || at.down || tool.value === "pan" || !suggestedLines.value.length) return null;
  const feature = featureAt([at.x, at.y], at.touch);
  return feature === active.value ? null : feature;
});

export const canPropose = computed(() =>
  suggestedLines.value.some((f) => f.feature === active.value),
);

/** Look for points all along the active line, beside where the fit sees it. */
export async function propose() {
  const feature = active.value,
    picture = snapshot.value?.id,
    fit = givenFit();
  if (!picture || !fit) return;
  try {
    const { points } = await call("POST", `/snapshots/${picture}/along`, {
      fit,
      feature,
      count: WANTED,
    });
    if (snapshot.value?.id !== picture || active.value !== feature) return;
    const standing = pointsOf(doc.value, feature);
    const found = points
      .map((/** @type {{ point: Point }} */ p) => p.point)
      .filter((/** @type {Point} */ [x, y]) =>
        standing.every(([u, v]) => Math.hypot(x - u, y - v) > SPARE_PX),
      );
    proposals.value = { along: true, items: found.length ? [{ feature, points: found }] : [] };
    saySnapped(
      found.length
        ? t("calibrate.line-suggestions.proposed", {
            count: found.length,
            feature: lineName(feature),
          })
        : t("calibrate.line-suggestions.none-found", { feature: lineName(feature) }),
    );
  } catch (error) {
    notifyError(error);
  }
}

/** Take them over, as one change. @param {Proposal[]} [items] all, where none are named */
export function acceptProposed(items = offered.value) {
  let next = doc.value;
  const added = [];
  for (const { feature, points } of items) {
    const before = pointsOf(next, feature),
      rounded = points.map(
        ([x, y]) => /** @type {Point} */ ([Math.round(x * 100) / 100, Math.round(y * 100) / 100]),
      );
    next = withPoints(next, feature, [...before, ...rounded], kindOf(feature));
    added.push(...rounded.map((_, i) => ({ feature, index: before.length + i })));
  }
  if (!added.length) return;
  if (proposals.value.along) discardProposed();
  change(next);
  if (items.length === 1) selection.value = added;
  saySnapped(t("calibrate.line-suggestions.added", { count: added.length }));
}

export function discardProposed() {
  proposals.value = { along: true, items: [] };
}

/** Proposals belong to one line of one picture. */
export function startLineSuggestions() {
  effect(() => {
    const here = `${snapshot.value?.id}`,
      feature = active.value,
      at = editing.value;
    untracked(() => {
      const { along, items } = proposals.value;
      if (along && items.length && (items[0].feature !== feature || !here || !at))
        discardProposed();
    });
  });
  effect(() => {
    void snapshot.value?.id;
    untracked(discardProposed);
  });
}
