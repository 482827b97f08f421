// Raw and corrected against each other, grids, maps and arrows over them.
import { COMPARE_ACTIONS } from "./actions.js";
import { startComparing } from "./comparison.js";
import { startGrid } from "./grid.js";
import { startHeat } from "./heat.js";
import { MAP_ACTIONS } from "./map_actions.js";
import { startArrows } from "./residual_arrows.js";

/** @type {import("../../core/features.js").Feature} */
export const compare = {
  actions: [...COMPARE_ACTIONS, ...MAP_ACTIONS],
  start: [startComparing, startGrid, startHeat, startArrows],
};
