// What the pages beside the six steps hear from the server.
import type { Calibration, Job } from "./types";

/** One page: its name in the address, and what follows it there. */
export interface At { name: "jobs" | "settings" | "versions" | "capture" | "rig" | "scene"; argument: string }
/** A job as the list of all has it. made: ids of what it has kept. */
export interface JobInList extends Job { made: { calibration?: string; lens?: string }; created_at: string; ended_at: string | null }
export interface Setting { name: string; value: unknown; default: unknown; help: string; secret: boolean; change: string | null }
export interface Room {
  pictures_bytes: number; pictures_limit_bytes: number; free_bytes: number; database_bytes: number | null;
  backups: { count: number; used_bytes: number; limit_bytes: number; newest_at: string | null } | null;
}
export interface SettingsTold { version: string; items: Setting[]; storage: Room }
export interface Health { version: string; uptime_s: number; warnings: { reason: string; text: string; fix: string }[]; damaged: { kind: string; file: string; note: string | null }[] }
export interface Kept extends Calibration { made_by: string; parent: string | null }
export interface Activation { calibration: string; version: number | null; at: string; by: string }
export interface Apart { median_mm: number | null; max_mm: number | null; worst_place: [number, number] | null; rms_px: number | null; max_px: number | null }
/** What the server sees of a board before a live camera. quad: its outermost corners; wanted: the next view, null: enough. */
export interface Look {
  seq: number; width: number; height: number; corners: [number, number][]; quad: [number, number][] | null; still: boolean; new: boolean; hint: string;
  automatic: boolean; count: number; cells: number[][]; share: number; tilts: Record<string, number>;
  wanted: { text: string; outline: [number, number][]; nearer: string; tilt_deg: number } | null; taken: { id: string } | null;
}
