// What a live camera is to see, and what it sees, as the server tells it.
import type { Option } from "../../core/types";

export type PlanStage = { stage: string } & Record<string, unknown>;
/** corrected: its stages look at the corrected picture. */
export interface Plan { name: string; title: string; stages: PlanStage[]; corrected?: boolean }
export interface StageKind { name: string; title: string; help: string; options: Option[] }
/** A colour as it was seen. spread: how much its chroma varied there. */
export interface Sample { rgb: [number, number, number]; spread: number }
export interface Profile { name: string; colours: Record<string, Sample[]>; background: Sample[]; light: number[] | null; reach: number; margin: number }
/** margin: to the nearest other colour, in spreads; null: nothing is near. */
export interface ColourHealth { colour: string; margin: number | null; words: string; level: "good" | "close" | "mixed"; nearest: string | null }
/** GET /cameras/{id}/seeing, and whose it is. profile: that it goes by, its own, shared or found. */
export interface DetectionState {
  camera: string; on: boolean; plan: Plan; colours: string | null; profile: Profile | null; learned: "clicks" | "picture" | null; health: ColourHealth[];
  publish: boolean; published: { packets: number; problem: { reason: string; what: string; fix: string } | null };
  teams: Record<import("../referee/types").Team, import("../referee/types").TeamHeight>;
}
/** What an operator sets. profile: this camera's own, null where it shares or finds one. */
export interface DetectionSettings { on: boolean; plan: Plan; colours: string | null; profile: Profile | null; publish: boolean }
export interface Preset { name: string; updated_at: string; profile: Profile; health: ColourHealth[]; used_by: string[] }
export interface Item {
  kind: "ball" | "robot" | "marker"; team: string | null; id: number | null; pixel: [number, number]; x_mm: number | null; y_mm: number | null; z_mm: number;
  orientation_deg: number | null; confidence: number; covariance_mm2: [[number, number], [number, number]] | null; orientation_sigma_deg: number | null; area_px: number; on_carpet: boolean;
}
/** What one frame showed. */
export interface DetectionFrame {
  seq: number; width: number; height: number; calibration: string | null; items: Item[]; stages: { name: string; ms: number }[]; ms: number; notes: string[]; fps: number;
}
/** A frame that is held: a snapshot of that camera, or one of a clip. id: the snapshot's, "" where it has none yet. */
export interface HeldFrame { camera: string; id: string; width: number; height: number; clip: Clip | null; number: number }
export interface Clip { clip: string; camera: string; taken_at: string; width: number; height: number; frames: number; seconds: number; fps: number }
/** A place in the picture, or a box: raw px. */
export type Place = [number, number] | [number, number, number, number];
