// The shapes that cross the page: what the server sends (REST contract) and what the operator edits.

import type {
  ActiveVersion as SavedActive, BorderFit, Calibration as SavedCalibration, Camera as SavedCamera, FieldJson, ObservationJson, Polyline, PreviewMesh, Verdict,
} from "./rest"; // generated from the API's description

export type {
  ArcJson as Arc, FigureLevels as Levels, AreaJson as SeenArea, Arrow, CameraDrift as Drift, CameraDisplacement as Displacement, CameraStatus, DriftEntry, Event as Happening, LineJson as Line, Model, ObservationJson as Observation, OptionJson as Option, Preview, RankedModel as Ranked, Ranking,
  RegionJson as Region, ResidualArrows as Arrows, ResidualRow as Residual, Sag as Distortion, SavedReport as Report, Snapshot, SnappedPoint as SnapAnswer, WarningJson as Warning,
} from "./rest";
/** What is drawn over a picture: a marking of the field, or a line of a grid. */
export type Feature = Omit<Polyline, "kind"> & { kind: string };
/** own: made by an operator. */
export type Field = FieldJson & { own?: boolean };
/** POST /fit/border, with the points that it answers for. */
export type Curve = BorderFit & { points: Point[] };

export type Point = [number, number];
export type Border = "left" | "right" | "top" | "bottom";
/** How raw and corrected are set against each other. */
export type CompareMode = "raw" | "wipe" | "corrected" | "side" | "blink";
/** A step of calibrating; "" elsewhere. */
export type StepId = "" | "field" | "points" | "verify";

/** The operator's document: small, copied whole at every change, so that undo is an earlier copy. */
export interface Doc {
  field: string | null; region: string | null; rotate: number | null;
  model: string | null; options: Record<string, unknown>; observations: ObservationJson[];
}
/** One clicked point: which border, line, arc or landmark, and which of its points. */
export interface Pick { feature: string; index: number }

/** An imported version may have no verdict. */
export type ActiveVersion = Omit<SavedActive, "verdict"> & { verdict: Partial<Verdict> };
export type Camera = Omit<SavedCamera, "active"> & { active: ActiveVersion | null };
/** What comes with each frame of a stream. */
export interface LiveHead {
  seq: number; time: number; width: number; height: number; view: string; calibration: string | null; overlays?: { field: Polyline[] };
  halves?: { raw: Half; corrected: Half; margin_px: number }; // side by side: where each stands in the picture
}
export interface Half { x: number; y: number; width: number; height: number }
export interface Control {
  name: string; label: string; kind: "float" | "int" | "bool" | "choice"; value: number | boolean | string; unit: string;
  range: Point | null; choices: string[]; automatic: boolean | null;
}
export interface SourceKind { scheme: string; title: string; help: string; target: string; options: Option[] }
/** What a sentence of the server states, for a page in another language; a value may be a statement itself. */
export interface Statement { code?: string; values?: Record<string, StatedValue>; text?: string }
export type StatedValue = string | number | Statement | StatedValue[];
export interface Refusal { detail: string; fix: string; title?: string; reason?: string; feature?: string | null; index?: number | null; entry?: string; entries?: string[]; lenses?: LensReading[] }
/** A lens that a file may mean. */
export interface LensReading { model: "brown-conrady" | "fisheye"; view_deg: number; lens: { image_size: { width: number; height: number } } }
/** A lens from a board, in short. */
export interface Lens {
  id: string; created_at: string; camera: string | null; note: string; model: string; image_size: Point; views: number; rms_px: number | null;
  board: { kind: string; columns: number; rows: number; square_mm: number } | null; verdict: { level: string; sentence: string };
}
/** A lens with its whole report. */
export interface LensRecord {
  id: string; note: string; model: string; image_size: Point; snapshots: string[] | null;
  report: {
    rms_px: number; sigma_px: number; max_px: number; corners: number; strays: number; neighbour_correlation: number | null;
    views: { name: string; used: boolean; corners: number; rms_px: number; tilt_deg: number; nearer: string; text?: string }[];
    parameters: Record<string, { value: number; sigma: number | null }>; bow_mm: { x: number; y: number } | null;
    coverage: { cells: number[][]; share: number; tilts: Record<string, number> };
    expected_px: { median: number | null; max: number | null };
    cross_validation: { held_out_px: number | null; held_out_ratio: number | null; halves_px: number | null; halves_ratio: number | null };
    focal_drift?: { pct: number | null; sigma_pct: number | null };
    next_view: { text: string; worst_before_px: number; worst_after_px: number } | null;
    warnings: Warning[]; verdict: { level: "good" | "fair" | "poor"; sentence: string };
  };
}
export interface BoardRequest {
  kind: string; columns: number; rows: number; square_mm: number; marker_mm: number; dictionary: string; legacy: boolean; model: string; note: string;
}
export interface UploadedPicture { key: string; name: string; state: "waiting" | "uploading" | "kept" | "refused"; id: string; why: string; camera?: string; quad?: Point[] | null }
/** One edge: its points in the picture and in the straightened one, and how straight they are, px rms. */
export interface Edge {
  name: string; picture: number; points: number; length_px: number; before_px: number | null; after_px: number | null;
  used: boolean; reason: string | null; chain: (Point | null)[]; straight: (Point | null)[];
}
export interface Bow { line: number | null; length_px: number; px: number | null; sigma_px: number | null; pct: number | null }
/** How straight pictures show straight edges, and the lens that makes them straight. */
export interface Straightness {
  lens: { name: string; terms: Record<string, number>; unit_px: number; centre_px: Point; image_size: Point }; sigma: Record<string, number>;
  straightness_px: { before: number; after: number }; bow: { most: Bow; longest: Bow; border: Bow; noise_px: number };
  distortion: "significant" | "none" | "unknown"; edges_bow: { pct: Point; sigma_pct: Point } | null; sentence: string; lines_used: number; objects: number; lines: Edge[]; pictures: string[]; cannot_see: string;
}
/** Long work on the server. */
export interface Job {
  id: string; kind: string; state: "queued" | "running" | "done" | "failed" | "cancelled"; progress: number; message: string;
  result: any; problem: Record<string, any> | null; attempt: number;
}
/** Where an even grid over the corrected view lies in the raw picture. */
export type MeshHeader = Omit<PreviewMesh, "raw_px" | "overlay">;
export interface Mesh extends MeshHeader { nodes: Float32Array }
export interface Calibration extends Omit<SavedCalibration, "field_definition"> {
  /** What of its field lies elsewhere now than when it was made; only in brief lists. */
  field_changes?: string[];
  /** Empty in brief lists. */
  field_definition: FieldJson;
}
/** What a format of another program makes of a version; loss: mm over its region, null where it is exact. */
export interface Format {
  format: string; title: string; holds: string; exact: boolean; problem: { what: string; fix: string } | null;
  loss: { worst_mm: number; rms_mm: number; hat_worst_mm: number | null } | null;
}
/** Millimetres on a grid of field places: expected error of one version, or the difference between two. */
export interface HeatMap {
  of: string; what: "expected" | "difference"; z_mm: number; other: string | null; places: Point[][]; values: (number | null)[][];
  at: { corrected: (Point | null)[]; image: (Point | null)[] }; median_mm: number; worst_mm: number; worst_place: Point; rms_px: number | null; max_px: number | null;
}
/** about: its subject, such as "active/overhead"; a newer notice about it replaces this one. */
export interface Notice { id: number; at: number; level: "info" | "warn"; text: string; fix: string; about?: string; action?: { label: string; run: () => void } }
