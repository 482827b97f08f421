// A lens from straight edges.
import { t } from "../../core/words.js";
import { STRAIGHT_ACTIONS } from "./actions.js";
import { StraightForm, StraightPage, StraightReport } from "./panels/straight.js";
import { addEdgePictures, startStraight, straightNextStep } from "./straight.js";

/** @type {import("../../core/features.js").Feature<"edges">} */
export const straight = {
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
};
