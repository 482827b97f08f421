// A field while it is edited.
import type { Arc, Line, Point } from "../../core/types";

/** off: not on this field; kept until the page is left, so that it can be put back. */
export interface EditedLine extends Line { off?: true }
export interface EditedArc extends Arc { off?: true }
export interface EditedRegion { x: Point; y: Point; rotate: number }
export interface FieldDoc {
  name: string; title: string; length_mm: number; width_mm: number; lines: EditedLine[]; arcs: EditedArc[];
  landmarks: Record<string, Point>; regions: Record<string, EditedRegion>; hat_height_mm: number; line_sigma_mm: number;
  extras: Record<string, unknown>;
}
export type MarkKind = "line" | "arc" | "landmark" | "region";
export interface Mark { kind: MarkKind; name: string }
/** What of a chosen mark can be held: a line's end, an arc's radius or end, a region's edge. */
export interface Grip { mark: Mark; part: "from" | "to" | "radius" | "start" | "end" | "x0" | "x1" | "y0" | "y1"; at: Point }
