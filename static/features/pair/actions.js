// Actions on a pair of cameras: open it, show its worst match, choose whose epipolar lines are drawn.
import { go } from "../../core/route.js";
import { t } from "../../core/words.js";
import { chosenBasis, linesBases, linesBasis, worstMatch } from "./evaluation.js";
import { showWorst } from "./match_actions.js";
import { atPair } from "./pair.js";

/** @type {import("../../core/actions.js").Action[]} */
export const PAIR_ACTIONS = [
  {
    id: "pair",
    label: t("pair.action.compare"),
    group: "pictures",
    run: () => go("pair"),
  },
  {
    id: "worst-match",
    label: t("pair.action.worst"),
    short: t("pair.action.worst.short"),
    keys: ["x"],
    group: "points",
    run: showWorst,
    enabled: () => atPair.value && worstMatch.value >= 0,
  },
  {
    id: "pair-lines",
    label: t("pair.action.lines"),
    short: t("pair.action.lines.short"),
    group: "view",
    keys: ["s"],
    run: () => {
      chosenBasis.value = linesBasis.value === "matches" ? "calibrations" : "matches";
    },
    enabled: () => atPair.value && linesBases.value.matches !== null && linesBases.value.calibrations !== null,
  },
];
