// The manual, the list of keys and the tour.
import { HELP_ACTIONS } from "./actions.js";

/** @type {import("../../core/features.js").Feature} */
export const help = { actions: HELP_ACTIONS };
