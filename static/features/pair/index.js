// Two cameras compared by points of both.
import { t } from "../../core/words.js";
import { PAIR_ACTIONS } from "./actions.js";
import { pairNextStep, startEvaluation } from "./evaluation.js";
import { withPairActions } from "./match_actions.js";
import { openFiles, startPair } from "./pair.js";
import { PairForm } from "./panels/matches.js";
import { PairPage } from "./panels/pair_page.js";
import { PairReport } from "./panels/pair_report.js";

/** @type {import("../../core/features.js").Feature<"pair">} */
export const pair = {
  actions: PAIR_ACTIONS,
  adapt: withPairActions,
  start: [startPair, startEvaluation],
  views: {
    pair: {
      addresses: ["field/pairs/:left/:right", "field/pairs"],
      label: t("shell.view.pair"),
      Form: PairForm,
      Main: PairPage,
      Report: PairReport,
      add: openFiles,
      tabs: { field: 2 },
      tab: t("shell.tab.pair"),
      nextStep: pairNextStep,
    },
  },
  jobs: { pair: t("jobs.kind.pair") },
};
