// The shapes of the checks before a version is activated: what the server sends, and what the checklist shows.

import type { Point } from "../../core/types";

export type { CalibrationCheck } from "../../core/rest";

export type CheckState = "running" | "ok" | "note" | "bad" | "unknown";
/** One line of the checklist. value: the figure at the right. href: where the fix is done. */
export interface Check { id: string; state: CheckState; title: string; value: string; text: string; fix: string; href: string }
/** GET /calibrations/{former}/difference/{id}.json. mm_vector: on the floor, from the former version to this one. */
export interface Difference {
  median_mm: number | null; max_mm: number | null; worst_place: Point | null;
  lens: { focal_ratio: number; max_px: number | null } | null;
  grid: { places: Point[][]; mm: (number | null)[][]; mm_vector: ([number | null, number | null] | null)[][] } | null;
}
/** What changes on the field. from: the former version, in words. */
export interface Change { from: string; difference: Difference }
