// The game controller, and how high each team's robots are.
import { startReferee } from "./referee.js";

/** @type {import("../../core/features.js").Feature} */
export const referee = { start: [startReferee] };
