// What two neighbouring cameras of a rig share, and how far apart they are there.
import { computed } from "@preact/signals";
import { twos } from "./kept_matches.js";
import { found, plane, rig, stitched } from "./rig.js";

const NEAR_MM = 300; // areas as far apart are neighbours, too: their images overlap

/**
 * @typedef {import("../../ui/field_plan.js").Area} Area
 * @typedef {import("./types").Rig["cameras"][0]} Member
 * @typedef {{ median_mm: number, max_mm: number, level: "good" | "fair" | "poor" }} Figures
 * @typedef {"unchecked" | "moved" | "unknown"} Without why there are no figures
 */

/** The part of two areas that is in both, or the edge between them; null where only corners meet.
 * @param {Area} a @param {Area} b @returns {Area | null} */
export function sharedArea(a, b) {
  const x = common(a.x, b.x),
    y = common(a.y, b.y),
    sides = [x[1] - x[0], y[1] - y[0]];
  if (Math.min(...sides) < -NEAR_MM || Math.max(...sides) <= NEAR_MM) return null;
  return { x: x.toSorted((p, q) => p - q), y: y.toSorted((p, q) => p - q) };
}

/** @param {number[]} a @param {number[]} b */
const common = (a, b) => [Math.max(a[0], b[0]), Math.min(a[1], b[1])];

/** Every two calibrated cameras that are neighbours, with figures of the newest check. */
export const seams = computed(() => {
  const it = rig.value;
  if (!it) return [];
  return twos(it.cameras).flatMap(([a, b]) => {
    const area = a.calibration && b.calibration && a.area && b.area && sharedArea(a.area, b.area);
    return area
      ? [{ key: `${a.camera}-${b.camera}`, area, figures: figuresOf(a.camera, b.camera) }]
      : [];
  });
});

/** @param {string} a @param {string} b @returns {Figures | Without} */
function figuresOf(a, b) {
  const isIt = (/** @type {{ a: string, b: string }} */ p) => p.a === a && p.b === b,
    checked = rig.value?.checked,
    saved = checked?.pairs.find(isIt),
    fresh = found.value?.pairs.find(isIt);
  if (fresh) {
    const at = fresh.agreement?.[plane.value],
      level = fresh.verdict?.level;
    return at && level ? { median_mm: at.median_mm, max_mm: at.max_mm, level } : "unknown";
  }
  if (saved || !checked) return saved ?? "unchecked";
  return checked.verdict.reason === "outdated" ? "moved" : "unknown";
}

/** Why a camera is not in the picture; "" where it is, or where that is not known yet. @param {Member} member */
export function absence({ camera, calibration, troubles }) {
  if (!calibration) return "uncalibrated";
  if (!stitched.value?.missing.includes(camera)) return "";
  return troubles.some(({ reason }) => reason === "other-field") ? "other-field" : "no-image";
}
