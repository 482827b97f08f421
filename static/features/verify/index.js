// What is claimed of a version, before it is activated.
import { VERIFY_ACTIONS } from "./actions.js";

/** @type {import("../../core/features.js").Feature} */
export const verify = { actions: VERIFY_ACTIONS };
