// The shapes of a pair of pictures: what the operator matches, and what the server says of it (POST /pairs, /pairs/lines).

import type { Point } from "../../core/types";

/** a: the left picture, b: the right one. */
export type Side = "a" | "b";
/** One thing in two pictures; null: not clicked there yet. z_mm: its height above the carpet, null where it is not known. */
export interface Match { a: Point | null; b: Point | null; z_mm: number | null }
/** What is kept of two pictures. calibrations: null: the proposal; "": none. */
export interface PairDoc { matches: Match[]; calibrations: Record<Side, string | null> }
export interface Question {
  points_a?: (Point | null)[]; points_b?: (Point | null)[]; z_mm?: (number | null)[]; calibration_a?: string; calibration_b?: string;
}
export interface Verdict { level: "good" | "fair" | "poor"; sentence: string; fix: string }
export type PartName = "fundamental" | "pose" | "calibrated" | "agreement";
/** Lists are one value a match, in the numbering that was sent. */
export interface PairAnswer {
  fundamental: { matrix: number[][]; rms_px: number; sigma_px: number; epipolar_px: (number | null)[]; outliers: number[]; verdict: Verdict } | null;
  pose: {
    rotation_deg: number[]; angle_deg: number; direction: number[]; rotation_sigma_deg: number; direction_sigma_deg: number; rms_px: number;
    from_calibrations_deg: { rotation: number; direction: number | null }; verdict: Verdict;
  } | null;
  calibrated: {
    median_px: number; rms_px: number; epipolar_px: (number | null)[]; rotation_deg: number[]; angle_deg: number; translation_mm: number[];
    distance_mm: number; verdict: Verdict;
  } | null;
  agreement: {
    n: number; from: "matches" | "clicks"; median_mm: number; rms_mm: number; max_mm: number; where: Point; shift_mm: Point; overlap_m2: number;
    covered: number; apart_mm: (number | null)[] | null; map: { x: number[]; y: number[]; mm: (number | null)[][] }; verdict: Verdict;
  } | null;
  matches: number;
  failed: { part: PartName; reason: string; what: string; fix: string }[];
}
type Lines = ((Point | null)[] | null)[];
export interface PairLines { in_a: Lines | null; in_b: Lines | null; place_in_a: (Point | null)[] | null; place_in_b: (Point | null)[] | null }
