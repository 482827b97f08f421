// A lens from what is straight: edges in pictures, and balls that roll before a live camera.
import { t } from "../../core/words.js";
import { STRAIGHT_ACTIONS } from "./actions.js";
import { RollsForm, RollsPage, RollsReport } from "./panels/rolls.js";
import { StraightForm, StraightPage, StraightReport } from "./panels/straight.js";
import { ROLL_ACTIONS } from "./roll_actions.js";
import { rollsNextStep, startRolls } from "./rolls.js";
import { addEdgePictures, startStraight, straightNextStep } from "./straight.js";

/**
 * @typedef {import("../../core/features.js").Feature<"edges">} Edges
 * @typedef {import("../../core/features.js").Feature<"ball">} Ball
 * @type {{ edges: Edges, rolls: Ball }}
 */
export const straight = {
  edges: {
    actions: STRAIGHT_ACTIONS,
    start: [startStraight],
    views: {
      edges: {
        addresses: ["lenses/edges"],
        label: t("shell.view.edges"),
        Form: StraightForm,
        Main: StraightPage,
        Report: StraightReport,
        add: addEdgePictures,
        tabs: { lenses: 3 },
        nextStep: straightNextStep,
      },
    },
    jobs: { straightness: t("jobs.kind.straightness") },
  },
  rolls: {
    actions: ROLL_ACTIONS,
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
  },
};
