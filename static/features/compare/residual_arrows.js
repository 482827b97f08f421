// Residual arrows, from each click to where the model puts it, magnified. The server computes them.
import { computed, effect, signal, untracked } from "@preact/signals";
import { call } from "../../core/api.js";
import { comparing, editing, notifyError, snapshot } from "../../core/state.js";
import { MARGIN_PX } from "../../canvas/viewport.js";
import { preview } from "../calibrate/fitting.js";
import { version } from "../versions/versions.js";

/** @typedef {import("../../core/types").Arrow} Arrow @typedef {import("../../core/types").Arrows} Arrows */

export const FACTORS = [1, 2, 5, 10, 20, 50, 100, 200];
const READABLE = 1 / 14; // of the picture's diagonal: so long may the longest arrow be that is no stray's
const LONGEST = 1 / 8; // of it: longer ones are cut, and drawn so

/** factor: how much longer they are drawn; null: chosen by itself. */
export const arrows = signal(
  /** @type {{ on: boolean, factor: number | null }} */ ({ on: false, factor: null }),
);
/** Of the saved version that is compared, in both its pictures. */
const fetched = signal(
  /** @type {{ id: string, image: Arrows, corrected: Arrows } | null} */ (null),
);

export const canArrow = computed(() =>
  editing.value ? preview.value !== null : comparing.value && version.value !== null,
);

const previewed = computed(() => {
  const report = preview.value?.report;
  return !report
    ? null
    : {
        mm_per_px: report.mm_per_px,
        arrows: report.per_feature.flatMap(({ feature, residuals }) =>
          residuals.map((r, index) => ({ ...r, feature, index })),
        ),
      };
});

/** What is to be drawn on each picture now. */
export const shownArrows = computed(() => {
  if (!arrows.value.on || !canArrow.value) return null;
  if (editing.value) return previewed.value && { image: previewed.value, corrected: null };
  return fetched.value?.id === version.value?.id ? fetched.value : null;
});

const diagonal = computed(() =>
  Math.hypot(snapshot.value?.width ?? 0, snapshot.value?.height ?? 0),
);
/** In raw pixels: an arrow that would be drawn longer is cut. */
export const longest = computed(() => LONGEST * diagonal.value);

/**
 * The longest arrow, among strays or among the others.
 * @param {Arrow[]} all
 * @param {boolean} outlier
 * @returns {(Arrow & { px: number }) | null}
 */
export function longestOf(all, outlier) {
  let found = null;
  for (const arrow of all)
    if (arrow.px !== null && arrow.outlier === outlier && (!found || arrow.px > found.px))
      found = { ...arrow, px: arrow.px };
  return found;
}

export const factor = computed(() => {
  const all = shownArrows.value?.image.arrows ?? [],
    far = longestOf(all, false) ?? longestOf(all, true);
  return (
    arrows.value.factor ??
    FACTORS.findLast((f) => far && f * far.px <= READABLE * diagonal.value) ??
    FACTORS[0]
  );
});

/** @param {number | null} chosen null: by itself */
export const magnify = (chosen) => {
  arrows.value = { ...arrows.value, factor: chosen };
};

/** The next larger or smaller factor. @param {1 | -1} step */
export const magnifyBy = (step) =>
  magnify(FACTORS[Math.min(Math.max(FACTORS.indexOf(factor.value) + step, 0), FACTORS.length - 1)]);

/** Fetch the arrows of the version that is compared, from now on. */
export function startArrows() {
  effect(() => {
    const id = arrows.value.on && comparing.value ? version.value?.id : null;
    untracked(() => {
      if (!id || fetched.value?.id === id) return;
      const get = (/** @type {string} */ frame, margin = 0) =>
        call("GET", `/calibrations/${id}/residuals.json?frame=${frame}&margin_px=${margin}`);
      Promise.all([get("raw"), get("corrected", MARGIN_PX)]).then(([image, corrected]) => {
        fetched.value = { id, image, corrected };
      }, notifyError);
    });
  });
}
