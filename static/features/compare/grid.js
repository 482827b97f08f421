// A grid of field millimetres over both pictures: straight on the corrected one, bent as the lens bends on the raw one.
import { computed, effect, signal, untracked } from "@preact/signals";
import { call } from "../../core/api.js";
import { notifyError } from "../../core/state.js";
import { comparedVersion, margin } from "./comparison.js";

/** @typedef {import("../../core/types").Point} Point @typedef {import("../../core/types").Feature} Feature */

export const SPACINGS_MM = [50, 100, 200, 250, 500, 1000, 2000];
const MAX_SQUARES = 12; // squares along the longer side, unless the operator wants more
const ALLOWED = 60; // more would hide the picture
const STEPS = 32; // of a line: what is bent is drawn in so many pieces

/** spacing_mm: null, chosen by itself. */
export const grid = signal(
  /** @type {{ on: boolean, spacing_mm: number | null }} */ ({ on: false, spacing_mm: null }),
);

const part = computed(() =>
  comparedVersion.value
    ? (comparedVersion.value.field_definition.regions[comparedVersion.value.region] ?? null)
    : null,
);
const side_mm = computed(() =>
  part.value ? Math.max(part.value.x[1] - part.value.x[0], part.value.y[1] - part.value.y[0]) : 0,
);
/** Those that make a grid of this field. */
export const spacings = computed(() =>
  SPACINGS_MM.filter((mm) => side_mm.value / mm <= ALLOWED && side_mm.value / mm >= 2),
);
/** Between two lines, mm. */
export const spacing = computed(() => {
  const wish = grid.value.spacing_mm;
  if (wish !== null && spacings.value.includes(wish)) return wish;
  return (
    spacings.value.find((mm) => side_mm.value / mm <= MAX_SQUARES) ??
    spacings.value.at(-1) ??
    SPACINGS_MM[0]
  );
});

const question = computed(() =>
  grid.value.on && comparedVersion.value && part.value
    ? JSON.stringify([
        comparedVersion.value.id,
        spacing.value,
        margin.value,
        part.value.x,
        part.value.y,
      ])
    : "",
);
const fetched = signal(
  /** @type {{ of: string, raw: Feature[], corrected: Feature[] } | null} */ (null),
);
/** The grid in pixels of each picture, the corrected one's margin counted. */
export const gridLines = computed(() =>
  question.value && fetched.value?.of === question.value ? fetched.value : null,
);

/**
 * The lines that stand at whole spacings, as places of the field.
 * @param {{ x: Point, y: Point }} region mm
 * @param {number} spacing_mm
 * @returns {{ feature: string, places: Point[] }[]}
 */
function linesOver({ x, y }, spacing_mm) {
  const whole = ([from, to] = x) =>
    Array.from(
      {
        length: Math.max(
          0,
          Math.floor(to / spacing_mm + 1e-9) - Math.ceil(from / spacing_mm - 1e-9) + 1,
        ),
      },
      (_, i) => (Math.ceil(from / spacing_mm - 1e-9) + i) * spacing_mm,
    );
  const between = ([from, to] = x) =>
    Array.from({ length: STEPS + 1 }, (_, i) => from + ((to - from) * i) / STEPS);
  return [
    ...whole(x).map((at) => ({
      feature: `x ${at}`,
      places: between(y).map((v) => /** @type {Point} */ ([at, v])),
    })),
    ...whole(y).map((at) => ({
      feature: `y ${at}`,
      places: between(x).map((v) => /** @type {Point} */ ([v, at])),
    })),
  ];
}

/** Fetch the grid that is wanted, from now on. */
export function startGrid() {
  effect(() => {
    const of = question.value,
      id = comparedVersion.value?.id,
      region = part.value,
      around = margin.value,
      spacing_mm = spacing.value;
    untracked(() => {
      if (!of || !region || fetched.value?.of === of) return;
      const wanted = linesOver(region, spacing_mm),
        points = wanted.flatMap((l) => l.places);
      const seen = async (/** @type {string} */ to, move = 0) => {
        const found = (
          await call("POST", `/calibrations/${id}/transform`, { from: "field", to, points })
        ).points;
        return wanted.map(({ feature }, i) => ({
          feature,
          kind: feature.endsWith(" 0") ? "axis" : "grid",
          points: found
            .slice(i * (STEPS + 1), (i + 1) * (STEPS + 1))
            .map((/** @type {Point | null} */ p) => p && [p[0] + move, p[1] + move]),
        }));
      };
      Promise.all([seen("image"), seen("corrected", around)]).then(([raw, corrected]) => {
        fetched.value = { of, raw, corrected };
      }, notifyError);
    });
  });
}
