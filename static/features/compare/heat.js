// A heat map in millimetres over the picture: expected error of a version, or difference between two. The server
// computes it.
import { computed, effect, signal, untracked } from "@preact/signals";
import { ServerUnreachable, call } from "../../core/api.js";
import { latestWins } from "../../core/latest_wins.js";
import { comparing, editing } from "../../core/state.js";
import { t } from "../../core/words.js";
import { isSaved, version, versions } from "../versions/versions.js";

/** @typedef {import("../../core/types").Point} Point @typedef {import("../../core/types").HeatMap} HeatMap */

/** How high robots of the version's field carry their patterns. */
// kept before fields said so: the largest league
export const hatMm = computed(() => version.value?.field_definition.hat_height_mm ?? 150);

/** What the operator wants to see. atHats: at that height, not on the carpet. other: the version to compare with. */
export const heat = signal(
  /** @type {{ what: "none" | "expected" | "difference", atHats: boolean, other: string | null }} */ ({
    what: "none",
    atHats: false,
    other: null,
  }),
);
/** The newest answer, or why there is none; `of` says to which question. */
export const heatMap = signal(/** @type {HeatMap | null} */ (null));
export const heatRefusal = signal(
  /** @type {{ of: string, detail: string, fix: string } | null} */ (null),
);

/** Whether a saved version is in sight whose map could be shown. */
export const canHeat = computed(
  () => version.value !== null && (comparing.value || (editing.value && isSaved.value)),
);

/** Other versions that a picture of this size can be compared with: of the same camera, else of the same picture. */
export const comparableVersions = computed(() => {
  const it = version.value;
  return !it
    ? []
    : versions.value.filter(
        (v) =>
          v.id !== it.id &&
          String(v.image_size) === String(it.image_size) &&
          (it.camera ? v.camera === it.camera : v.snapshot === it.snapshot),
      );
});

/** @typedef {{ id: string, what: "expected" | "difference", z_mm: number, other: string | null }} Question */
const question = computed(() => {
  const { what, atHats, other } = heat.value,
    id = version.value?.id;
  if (!canHeat.value || !id || what === "none" || (what === "difference" && !other)) return null;
  return /** @type {Question} */ (
    what === "expected"
      ? { id, what, z_mm: atHats ? hatMm.value : 0, other: null }
      : { id, what, z_mm: 0, other }
  );
});

/** The map that is to be drawn now. */
export const shownMap = computed(() =>
  question.value && heatMap.value?.of === JSON.stringify(question.value) ? heatMap.value : null,
);
/** Why it cannot be drawn. */
export const mapRefusal = computed(() =>
  question.value && heatRefusal.value?.of === JSON.stringify(question.value)
    ? heatRefusal.value
    : null,
);
export const isMapWanted = computed(() => question.value !== null);

const ask = latestWins(async (/** @type {Question} */ asking) => {
  const of = JSON.stringify(asking),
    { id, what, z_mm, other } = asking;
  try {
    const found = await call(
      "GET",
      `/calibrations/${id}/${what === "expected" ? `uncertainty.json?z_mm=${z_mm}` : `difference/${other}.json`}`,
    );
    if (!found.grid)
      throw Object.assign(new Error(t("compare.heat.nothing-in-common")), {
        fix: t("compare.heat.choose-another"),
      });
    const { places } = found.grid,
      values = found.grid.sigma_mm ?? found.grid.mm;
    // The worst place rides along. Heights are drawn above the place on the carpet where a robot stands.
    const points = [...places.flat(), found.worst_place];
    const where = async (/** @type {string} */ to) =>
      (await call("POST", `/calibrations/${id}/transform`, { from: "field", to, points })).points;
    const [corrected, image] = await Promise.all([where("corrected"), where("image")]);
    heatMap.value = {
      of,
      what,
      z_mm,
      other,
      places,
      values,
      at: { corrected, image },
      median_mm: found.median ?? found.median_mm,
      worst_mm: found.max ?? found.max_mm,
      worst_place: found.worst_place,
      rms_px: found.rms_px ?? null,
      max_px: found.max_px ?? null,
    };
  } catch (error) {
    if (error instanceof ServerUnreachable) return;
    const { message, fix } = /** @type {{ message: string, fix?: string }} */ (error);
    heatRefusal.value = { of, detail: message, fix: fix ?? "" };
  }
});

/** Fetch the map that is wanted, from now on. */
export function startHeat() {
  effect(() => {
    const asking = question.value;
    untracked(() => {
      if (asking && !shownMap.value && !mapRefusal.value) void ask(asking);
    });
  });
}

/** Compare with a version; without one, with the one before. @param {string | null} [id] */
export function differenceFrom(id) {
  const other = id ?? heat.value.other ?? comparableVersions.value[0]?.id ?? null;
  heat.value = { ...heat.value, what: "difference", other };
}

/**
 * Between the grid's places, as the colours are drawn.
 * @param {HeatMap} map
 * @param {Point} spot field mm
 * @returns {number | null}
 */
export function valueAt({ places, values }, [x, y]) {
  const rows = places.length,
    columns = places[0].length,
    [x0, y0] = places[0][0];
  /** @param {Point} end @param {number} steps */
  const along = ([ex, ey], steps) =>
    (steps * ((x - x0) * (ex - x0) + (y - y0) * (ey - y0))) / ((ex - x0) ** 2 + (ey - y0) ** 2);
  const u = along(places[0][columns - 1], columns - 1),
    v = along(places[rows - 1][0], rows - 1);
  if (u < 0 || v < 0 || u > columns - 1 || v > rows - 1) return null;
  const c = Math.min(Math.floor(u), columns - 2),
    r = Math.min(Math.floor(v), rows - 2),
    p = u - c,
    q = v - r;
  const [a, b, d, e] = [values[r][c], values[r][c + 1], values[r + 1][c], values[r + 1][c + 1]];
  if (a === null || b === null || d === null || e === null) return null;
  return (a * (1 - p) + b * p) * (1 - q) + (d * (1 - p) + e * p) * q;
}
