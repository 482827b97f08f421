// The shapes of the checks before a version is activated: what the server sends, and what the checklist shows.

import type { ClaimJson, Claims, Difference } from "../../core/rest";

export type { Difference } from "../../core/rest";
export type Claim = ClaimJson;
export type Gate = Claims["gate"];

export type CheckState = "running" | "ok" | "note" | "bad" | "unknown";
/** One line of the checklist. value: the figure at the right. href: where the fix is done. isProblem: whether it
 * stands against activation. */
export interface Check { id: string; state: CheckState; title: string; value: string; text: string; fix: string; href: string; isProblem: boolean }
/** What changes on the field. from: the former version, in words. */
export interface Change { from: string; difference: Difference }
