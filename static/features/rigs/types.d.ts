// The shapes of rigs: what the server says of them, what the operator makes, and the points matched in two cameras.

import type { Point } from "../../core/types";
import type { RigPair } from "../../core/rest";

export type { PairLines, PairReport, RigJson as Rig, RigReport as RigCheck, StitchedView as Stitched } from "../../core/rest";
export type Pair = RigPair;

/** A rig that is being made. */
export interface Draft { name: string; title: string; field: string; cameras: { camera: string; region: string | null }[] }

/** a: the first camera of the two, as the rig has them, and its image, at the left; b: the other. */
export type Side = "a" | "b";
/** One thing in two images; null: not marked there yet. z_mm: its height above the carpet, null where it is not known. */
export interface Match { a: Point | null; b: Point | null; z_mm: number | null }
/** Two images, by their ids, null before they are taken; and what is matched in them. */
export interface MatchDoc { pictures: Record<Side, string> | null; matches: Match[] }
/** Complete matches as a check takes them. */
export interface SentMatches { a: string; b: string; points_a: Point[]; points_b: Point[]; z_mm: (number | null)[] }
