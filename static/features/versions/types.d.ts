// Saved versions, what was active when, and how far two are apart.
import type { Calibration } from "../../core/types";

export interface VersionRecord extends Calibration { made_by: string; parent: string | null }
export interface Activation { calibration: string; version: number | null; at: string; by: string }
export interface VersionDifference { median_mm: number | null; max_mm: number | null; worst_place: [number, number] | null; rms_px: number | null; max_px: number | null }
