// Rigs: cameras that see one field together.
import { t } from "../../core/words.js";
import { RIG_ACTIONS } from "./actions.js";
import { FieldPage } from "./panels/field_page.js";
import { NewRig } from "./panels/new_rig.js";
import { RigForm, RigPage, RigReport } from "./panels/rig.js";
import { rigNextStep, startRig } from "./rig.js";
import { TRACK_ACTIONS, startTracks } from "./tracks.js";

/**
 * @typedef {import("../../core/features.js").Feature<"field" | "new-rig" | "rig">} Rigs
 * @type {{ rigs: Rigs, tracks: import("../../core/features.js").Feature }}
 */
export const rig = {
  rigs: {
    actions: RIG_ACTIONS,
    start: [startRig, startTracks],
    views: {
      field: {
        addresses: ["field"],
        label: t("shell.place.field"),
        Main: FieldPage,
        tabs: { field: 1 },
        tab: t("shell.tab.field"),
      },
      "new-rig": {
        addresses: ["field/new"],
        label: t("shell.view.new-rig"),
        Form: RigForm,
        Main: NewRig,
        behind: "field",
        nextStep: rigNextStep,
      },
      rig: {
        addresses: ["field/rigs/:rig"],
        label: t("shell.view.rig"),
        Form: RigForm,
        Main: RigPage,
        Report: RigReport,
        behind: "field",
        nextStep: rigNextStep,
      },
    },
    jobs: { "rig-check": t("jobs.kind.rig-check"), "rig-refit": t("jobs.kind.rig-refit") },
  },
  tracks: { actions: TRACK_ACTIONS },
};
