// Residuals as a plot wants them: signed, border after border and along each one; and which of them is pointed at.
import { computed, effect, signal, untracked } from "@preact/signals";
import { BORDERS, doc } from "../../core/document.js";
import { comparing, editing, pointer } from "../../core/state.js";
import { view } from "../../canvas/viewport.js";
import { pointedAt } from "../compare/comparison.js";
import { version } from "../versions/versions.js";
import { curves, isCurve, preview, stale } from "./fitting.js";

/** @typedef {import("../../core/types").Pick} Pick @typedef {import("../../core/types").Point} Point
 * @typedef {{ feature: string, index: number, px: number | null, mm: number | null, stray: boolean, at: number, point:
 * Point }} Bar at: along its line, 0 to 1
 * @typedef {{ feature: string, bars: Bar[] }} Group */

const REACH_PX = 14; // on the stage: so near the pointer is at a point

/** What is shown of them. */
export const plot = signal(
  /** @type {{ unit: "px" | "mm", kind: "along" | "histogram" }} */ ({ unit: "px", kind: "along" }),
);
/** What is pointed at, in the plot or in the picture. */
export const hovered = signal(/** @type {Pick[]} */ ([]));

const report = computed(
  () => (comparing.value ? version.value?.report : preview.value?.report) ?? null,
);

/** Every line with its clicks, in the order in which the eye meets them.
 * A residual is positive where the click lies to the right of its line or below it; from an arc, outside; of a spot,
 * always. */
export const groups = computed(() => {
  const it = report.value,
    isOld = !comparing.value && stale.value && plot.value.unit === "px";
  if (!it || isOld) return fromCurves();
  const names = it.per_feature.flatMap(({ feature }) =>
    typeof feature === "string" ? [feature] : [],
  );
  return [...new Set(names)].map((name) =>
    group(
      name,
      it.per_feature.filter((f) => f.feature === name).flatMap(({ residuals }) => residuals),
    ),
  );
});

/** What the borders alone tell, until the whole fit does. @returns {Group[]} */
function fromCurves() {
  return BORDERS.flatMap((feature) => {
    const curve = curves.value[feature];
    if (!isCurve(curve)) return [];
    const strays = new Set(curve.outliers);
    return [
      ordered(
        feature,
        curve.points.map((point, index) => ({
          feature,
          index,
          px: curve.residuals_px[index],
          mm: null,
          stray: strays.has(index),
          at: 0,
          point,
        })),
      ),
    ];
  });
}

/** @param {string} feature @param {import("../../core/types").Residual[]} residuals @returns {Group} */
function group(feature, residuals) {
  const feet = residuals.flatMap(({ foot }) => (foot ? [foot] : [])),
    middle = mean(feet),
    isArc = feature.includes("circle") || feature.includes("arc");
  const isSpot = residuals.length === 1 && !BORDERS.includes(/** @type {any} */ (feature));
  return ordered(
    feature,
    residuals.map(({ point, foot, px, mm, outlier }, index) => {
      const p = point ?? [0, 0],
        [dx, dy] = foot ? [p[0] - foot[0], p[1] - foot[1]] : [0, 0];
      const out =
        isArc && foot
          ? dx * (foot[0] - middle[0]) + dy * (foot[1] - middle[1])
          : Math.abs(dx) > Math.abs(dy)
            ? dx
            : dy;
      const sign = isSpot || out >= 0 ? 1 : -1;
      return {
        feature,
        index,
        px: px === null ? null : sign * px,
        mm: mm === null ? null : sign * mm,
        stray: outlier,
        at: 0,
        point: p,
      };
    }),
  );
}

/**
 * Along the line, from its first click in sight to its last.
 * @param {string} feature
 * @param {Bar[]} bars
 * @returns {Group}
 */
function ordered(feature, bars) {
  const span = (/** @type {0 | 1} */ axis) =>
    Math.max(...bars.map(({ point }) => point[axis])) -
    Math.min(...bars.map(({ point }) => point[axis]));
  const run = span(0) > span(1) ? 0 : 1,
    from = Math.min(...bars.map(({ point }) => point[run])),
    length = span(run);
  return {
    feature,
    bars: bars
      .map((bar) => ({ ...bar, at: length > 0 ? (bar.point[run] - from) / length : 0.5 }))
      .toSorted((a, b) => a.at - b.at),
  };
}

/** @param {Point[]} points @returns {Point} */
const mean = (points) =>
  /** @type {Point} */ (
    [0, 1].map((i) => points.reduce((sum, p) => sum + p[i], 0) / Math.max(1, points.length))
  );

/** These are pointed at now. @param {Pick[]} picks */
export function pointAt(picks) {
  const before = hovered.peek();
  if (picks.length !== before.length || picks.some((p, i) => !isSame(p, before[i])))
    hovered.value = picks;
}

/** @param {Pick} a @param {Pick} b */
export const isSame = (a, b) => a.feature === b.feature && a.index === b.index;

/** Follow the pointer over the picture: the click that is near it is the one pointed at. */
export function startHovering() {
  effect(() => {
    const at = pointer.value,
      isRaw =
        at !== null && (editing.value || (comparing.value && pointedAt.value?.from === "image")),
      { k } = view.peek();
    untracked(() => {
      if (!at || at.down || !isRaw) return pointAt([]);
      let near = null,
        reach = REACH_PX / k;
      for (const { feature, points } of editing.value
        ? doc.value.observations
        : (version.value?.observations ?? [])) {
        if (typeof feature !== "string") continue;
        for (const [index, p] of points.entries()) {
          const far = Math.hypot(p[0] - at.x, p[1] - at.y);
          if (far <= reach) {
            reach = far;
            near = { feature, index };
          }
        }
      }
      pointAt(near ? [near] : []);
    });
  });
}

/** A bar's length in the unit that is chosen. @param {Bar} bar */
export const valueOf = (bar) => (plot.value.unit === "px" ? bar.px : bar.mm);

/**
 * How many fall where: bins of one width, nought in the middle of one.
 * @param {Bar[]} bars
 * @returns {{ width: number, from: number, bins: Bar[][] } | null}
 */
export function binned(bars) {
  const values = bars.flatMap((bar) => {
    const v = valueOf(bar);
    return v === null ? [] : [v];
  });
  if (values.length < 2) return null;
  const most = Math.max(...values.map(Math.abs)),
    width = readable(
      (2 * most) / Math.max(7, Math.min(15, Math.round(Math.sqrt(values.length) * 2))),
    );
  const half = Math.ceil(most / width - 0.5),
    bins = Array.from({ length: 2 * half + 1 }, () => /** @type {Bar[]} */ ([]));
  for (const bar of bars) {
    const v = valueOf(bar);
    if (v !== null) bins[Math.min(2 * half, Math.max(0, Math.round(v / width) + half))].push(bar);
  }
  return { width, from: -half * width, bins };
}

/** At or above it: 1, 2, 2.5 or 5 times a power of ten. @param {number} value */
function readable(value) {
  const ten = 10 ** Math.floor(Math.log10(Math.max(value, 1e-6)));
  return [1, 2, 2.5, 5].map((f) => f * ten).find((v) => v >= value * (1 - 1e-9)) ?? 10 * ten;
}
