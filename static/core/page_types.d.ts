// What the pages beside the six steps hear from the server.
import type { Calibration, Job } from "./types";

/** One page: its name in the address, and what follows it there. */
export interface PageAddress { name: "jobs" | "settings" | "versions" | "capture" | "rig" | "rolls" | "scene" | "seeing"; argument: string }
/** A job as the list of all has it. made: ids of what it has kept. */
export interface JobInList extends Job { made: { calibration?: string; lens?: string }; created_at: string; ended_at: string | null }
export interface Setting { name: string; value: unknown; default: unknown; help: string; secret: boolean; change: string | null }
export interface DiskUsage {
  pictures_bytes: number; pictures_limit_bytes: number; free_bytes: number; database_bytes: number | null;
  backups: { count: number; used_bytes: number; limit_bytes: number; newest_at: string | null } | null;
}
export interface ServerSettings { version: string; items: Setting[]; storage: DiskUsage }
export interface Health { version: string; uptime_s: number; warnings: { reason: string; text: string; fix: string }[]; damaged: { kind: string; file: string; note: string | null }[] }
export interface VersionRecord extends Calibration { made_by: string; parent: string | null }
export interface Activation { calibration: string; version: number | null; at: string; by: string }
export interface VersionDifference { median_mm: number | null; max_mm: number | null; worst_place: [number, number] | null; rms_px: number | null; max_px: number | null }
/** What the server sees of a board before a live camera. quad: its outermost corners; wanted: the next view, null: enough. */
export interface BoardView {
  seq: number; width: number; height: number; corners: [number, number][]; quad: [number, number][] | null; still: boolean; new: boolean; hint: string;
  automatic: boolean; count: number; cells: number[][]; share: number; tilts: Record<string, number>;
  wanted: { text: string; outline: [number, number][]; nearer: string; tilt_deg: number } | null; taken: { id: string } | null;
}
/** One roll as a picture judges it. bow_pct: Eq. (9); spread_pct: its σ. */
export interface JudgedRoll { length_px: number; bow_pct: number; sigma_pct: number; spread_pct: number; rms_px: number; level: string; words: string; used: boolean }
/** A roll that is kept. at: unix, s; counts: whether it is of pictures of the newest one's size. */
export interface SavedRoll { id: string; at: number; seconds: number; left_out: boolean; counts: boolean; points: [number, number][]; raw: JudgedRoll | null; corrected: JudgedRoll | null }
export interface Zone { pct: number; sigma_pct: number; rolls: number }
/** What all rolls say of a picture. */
export interface RollsSummary { border_pct: number | null; border_sigma_pct: number | null; free: boolean; sentence: string; zones: (Zone | null)[][] }
export interface RollsResponse { camera: string; items: SavedRoll[]; report: { raw: RollsSummary; corrected: RollsSummary | null; sentence: string } | null }
/** What moves now, and the ids of rolls that have just ended. */
export interface MovingTracks { seq: number; width: number; height: number; tracks: [number, number][][]; hint: string; new: string[] }
