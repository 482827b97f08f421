// The shapes of a pair of pictures: what the operator matches, and what the server says of it.

import type { Point } from "../../core/types";

export type { PairLines, PairReport as PairAnswer, PairVerdict as Verdict } from "../../core/rest";

/** a: the left picture, b: the right one. */
export type Side = "a" | "b";
/** One thing in two pictures; null: not clicked there yet. z_mm: its height above the carpet, null where it is not known. */
export interface Match { a: Point | null; b: Point | null; z_mm: number | null }
/** What is kept of two pictures. calibrations: null: the proposal; "": none. */
export interface PairDoc { matches: Match[]; calibrations: Record<Side, string | null> }
export interface Question {
  points_a?: (Point | null)[]; points_b?: (Point | null)[]; z_mm?: (number | null)[]; calibration_a?: string; calibration_b?: string;
}
