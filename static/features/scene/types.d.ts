// Messages of WS /scene.
import type { Point } from "../../core/types";

export interface SheetInfo { max_mm: number | null; why: string | null; fix: string | null }
export interface SceneCamera {
  key: string; title: string; version: number; calibration: string; snapshot: string | null; camera: string | null; model: string; colour: [number, number, number];
  height_mm: number | null; tilt_deg: number | null; why_no_frustum: string | null; why_not_whole: string | null; points: number;
  moved: { median_mm: number | null; max_mm: number | null; turn_deg: number | null; shift_mm: [number, number, number] | null } | null;
  sheet: { carpet: SheetInfo; hat: SheetInfo; hat_mm: number };
}
export interface SceneShown {
  cameras: SceneCamera[]; sheet_top_mm: number | null; scale: number | null; missing: { camera: string; text: string; fix: string }[];
  boards: { boards: number; nearest_mm: number; furthest_mm: number; covered: number } | null;
}
export interface PlaceIn { key: string; title: string; calibration: string; snapshot: string | null; pixel: Point | null; inside: boolean; hat_pixel: Point | null; sigma_mm: number | null; hat_sigma_mm: number | null }
export interface ClickedPlace { place_mm: Point; cameras: PlaceIn[] }
export type Layer = "pictures" | "rays" | "arrows" | "footprints" | "labels" | "moved" | "things";
export interface SceneViewSettings { layers: Layer[]; hidden: string[]; sheet: "none" | "carpet" | "hat"; scale: number | null; dark: boolean; view: "free" | "above" | "camera"; through: string }
