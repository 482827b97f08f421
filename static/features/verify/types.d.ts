// The shapes of the checks before a version is activated: what the server sends, and what the checklist shows.

import type { Difference } from "../../core/rest";

export type { CalibrationCheck, Difference } from "../../core/rest";

export type CheckState = "running" | "ok" | "note" | "bad" | "unknown";
/** One line of the checklist. value: the figure at the right. href: where the fix is done. */
export interface Check { id: string; state: CheckState; title: string; value: string; text: string; fix: string; href: string }
/** What changes on the field. from: the former version, in words. */
export interface Change { from: string; difference: Difference }
