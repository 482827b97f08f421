// Whether a camera has moved, and its pose updated.
import { t } from "../../core/words.js";
import { CheckReport } from "../check/panels/check.js";
import { startDisplacement } from "./displacement.js";
import { DRIFT_ACTIONS, driftNextStep } from "./drift.js";
import { DriftPage } from "./panels/drift_page.js";

/** @type {import("../../core/features.js").Feature<"drift">} */
export const drift = {
  actions: DRIFT_ACTIONS,
  start: [startDisplacement],
  views: {
    drift: {
      addresses: ["cameras/:camera/drift"],
      label: t("shell.view.drift"),
      Main: DriftPage,
      Report: CheckReport,
      tabs: { cameras: 3 },
      nextStep: driftNextStep,
    },
  },
  jobs: { register: t("jobs.kind.register") },
};
