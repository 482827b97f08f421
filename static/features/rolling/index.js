// A lens from rolling balls.
import { t } from "../../core/words.js";
import { ROLLING_ACTIONS } from "./actions.js";
import { RollsForm, RollsPage, RollsReport } from "./panels/rolls.js";
import { rollsNextStep, startRolls } from "./rolls.js";

/** @type {import("../../core/features.js").Feature<"ball">} */
export const rolling = {
  actions: ROLLING_ACTIONS,
  start: [startRolls],
  views: {
    ball: {
      addresses: ["lenses/ball/:camera"],
      label: t("shell.view.ball"),
      Form: RollsForm,
      Main: RollsPage,
      Report: RollsReport,
      tabs: { lenses: 4 },
      nextStep: rollsNextStep,
    },
  },
  jobs: { motion: t("jobs.kind.motion") },
};
