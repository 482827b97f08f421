// The shapes of rigs: what GET /rigs, POST /rigs/{name}/check and GET /rigs/{name}/stitched.json answer.

import type { Point } from "../../core/types";

export interface Trouble { camera: string; reason: string; text: string; fix: string }
export interface Member { camera: string; title: string; region: string | null; rotate: number | null; calibration: string | null; version: number | null; model: string | null; rectangles: Rectangles | null; troubles: Trouble[] }
export interface Rectangles { w_max_rectangle_px: number; h_max_rectangle_px: number; n_rectangles_x: number; n_rectangles_y: number }
export interface Rig {
  name: string; title: string; field: string; cameras: Member[]; rectangles: Rectangles | null; rectangles_from: "rig" | "cameras" | null; updated_at: string;
  checked: { at: string; verdict: Verdict; p95_mm: number | null } | null;
  w_max_rectangle_px: number | null; h_max_rectangle_px: number | null; n_rectangles_x: number | null; n_rectangles_y: number | null;
}
export interface Verdict { level: "good" | "fair" | "poor" | null; sentence: string; fix: string }
export interface Plane { z_mm: number; mean_mm: number; p95_mm: number; max_mm: number; where: Point; map: { x: number[]; y: number[]; mm: (number | null)[][] } }
export interface Pair {
  a: string; b: string; from: "pictures" | "matches" | "clicks" | null; verdict: Verdict | null; notes: string[]; failed: { reason: string; what: string; fix: string } | null;
  agreement: { n: number; believed: number; overlap_m2: number; covered: number; carpet: Plane; hat: Plane | null } | null;
  fundamental: { matrix: number[][]; baseline_mm: number; angle_deg: number } | null;
}
export interface RigCheck { cameras: Member[]; pairs: Pair[]; verdict: Verdict; missing: Trouble[] }
export interface Stitched {
  width: number; height: number; px_per_mm: number; corner: Point[]; overlay: { feature: string; kind: string; points: Point[] }[];
  unseen: { share: number; m2: number; words: string }; cameras: { camera: string; share: number }[];
}
/** A rig that is being made. */
export interface Draft { name: string; title: string; field: string; cameras: { camera: string; region: string | null }[] }
