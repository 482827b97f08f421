// What is around every view: places, steps and the server's health.
import { startHealth } from "./health.js";
import { PAGE_ACTIONS } from "./page_actions.js";
import { STEP_ACTIONS } from "./step_actions.js";

/** @type {Record<"places" | "steps", import("../../core/features.js").Feature>} */
export const shell = {
  places: { actions: PAGE_ACTIONS, start: [startHealth] },
  steps: { actions: STEP_ACTIONS },
};
