// Field and corrected-picture positions of raw pixels, interpolated in a grid that is fetched once for a calibration.
import { computed, effect, signal } from "@preact/signals";
import { call } from "../../core/api.js";
import { detections } from "./held_frame.js";

/** @typedef {import("../../core/types").Point} Point @typedef {(Point | null)[]} Grid row after row */
/**
 * @typedef {{ id: string, size: Point, corrected: Point, hat_mm: number, onField: Grid, inCorrected: Grid }} Places
 * onField: at the robots' height
 */

const COLUMNS = 40,
  ROWS = 24; // under a thousand: answered at once
const STEP_PX = 2;
const USUAL_HAT_MM = 150;

/** Of the calibration by which is seen; null without one. */
const fetched = signal(/** @type {Places | null} */ (null));
const wanted = computed(() => detections.value?.calibration ?? null);
export const fieldPositions = computed(() =>
  fetched.value && fetched.value.id === wanted.value ? fetched.value : null,
);

export function startFieldPositions() {
  effect(() => {
    const id = wanted.value;
    if (id && fetched.peek()?.id !== id) void ask(id);
  });
}

/** @param {string} id */
async function ask(id) {
  try {
    const it = /** @type {import("../../core/types").Calibration} */ (
      await call("GET", `/calibrations/${id}`)
    );
    const [width, height] = it.image_size,
      hat_mm = it.field_definition.hat_height_mm ?? USUAL_HAT_MM;
    const points = Array.from({ length: COLUMNS * ROWS }, (_, i) => [
      ((i % COLUMNS) / (COLUMNS - 1)) * (width - 1),
      (Math.floor(i / COLUMNS) / (ROWS - 1)) * (height - 1),
    ]);
    const to = (/** @type {string} */ frame, z_mm = 0) =>
      call("POST", `/calibrations/${id}/transform`, { from: "image", to: frame, points, z_mm });
    const [onField, inCorrected] = await Promise.all([to("field", hat_mm), to("corrected")]);
    if (wanted.value === id)
      fetched.value = {
        id,
        size: it.image_size,
        corrected: it.corrected_size,
        hat_mm,
        onField: onField.points,
        inCorrected: inCorrected.points,
      };
  } catch {
    /* marks are then rings without a front */
  }
}

/**
 * Between the grid's points; null where one of them is out of reach.
 * @param {Places} it
 * @param {Grid} grid
 * @param {Point} pixel raw
 * @returns {Point | null}
 */
function between(it, grid, [x, y]) {
  const u = Math.min(Math.max((x / (it.size[0] - 1)) * (COLUMNS - 1), 0), COLUMNS - 1.001),
    v = Math.min(Math.max((y / (it.size[1] - 1)) * (ROWS - 1), 0), ROWS - 1.001);
  const i = Math.floor(v) * COLUMNS + Math.floor(u),
    a = u % 1,
    b = v % 1;
  const [p, q, r, s] = [grid[i], grid[i + 1], grid[i + COLUMNS], grid[i + COLUMNS + 1]];
  if (!p || !q || !r || !s) return null;
  const mix = (/** @type {0 | 1} */ k) =>
    (1 - b) * ((1 - a) * p[k] + a * q[k]) + b * ((1 - a) * r[k] + a * s[k]);
  return [mix(0), mix(1)];
}

/** @param {Places} it @param {Point} pixel raw */
export const correctedOf = (it, pixel) => between(it, it.inCorrected, pixel);

/**
 * A way on the field, from millimetres to raw pixels, at that place.
 * @param {Places} it
 * @param {Point} pixel
 * @returns {((x_mm: number, y_mm: number) => Point) | null}
 */
export function pixelsPerMm(it, [x, y]) {
  const at = (/** @type {number} */ dx, /** @type {number} */ dy) =>
    between(it, it.onField, [x + dx, y + dy]);
  const [e, w, s, n] = [at(STEP_PX, 0), at(-STEP_PX, 0), at(0, STEP_PX), at(0, -STEP_PX)];
  if (!e || !w || !s || !n) return null;
  const [a, b, c, d] = [e[0] - w[0], s[0] - n[0], e[1] - w[1], s[1] - n[1]].map(
    (v) => v / (2 * STEP_PX),
  ); // mm a pixel
  const det = a * d - b * c;
  return Math.abs(det) < 1e-9
    ? null
    : (x_mm, y_mm) => [(d * x_mm - b * y_mm) / det, (a * y_mm - c * x_mm) / det];
}
