// Actions on a pair of cameras: open it, show its worst match, choose whose epipolar lines are drawn.
import { go } from "../../core/route.js";
import { chosenBasis, linesBases, linesBasis, worstMatch } from "./evaluation.js";
import { showWorst } from "./match_actions.js";
import { atPair } from "./pair.js";

/** @type {import("../../core/actions.js").Action[]} */
export const PAIR_ACTIONS = [
  {
    id: "pair",
    label: "Compare two cameras…",
    group: "Pictures",
    run: () => go("pair"),
  },
  {
    id: "worst-match",
    label: "Show the worst match of two cameras",
    short: "Show the worst",
    keys: ["x"],
    group: "Points",
    run: showWorst,
    enabled: () => atPair.value && worstMatch.value >= 0,
  },
  {
    id: "pair-lines",
    label: "Switch epipolar lines between matches and calibrations",
    short: "Lines",
    group: "View",
    keys: ["s"],
    run: () => {
      chosenBasis.value = linesBasis.value === "matches" ? "calibrations" : "matches";
    },
    enabled: () => atPair.value && linesBases.value.matches !== null && linesBases.value.calibrations !== null,
  },
];
