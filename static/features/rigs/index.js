// Rigs: cameras that see one field together, points matched in two of them, and what all of them track.
import { t } from "../../core/words.js";
import { RIG_ACTIONS } from "./actions.js";
import { startFormerPairs } from "./former_pairs.js";
import { MATCH_ACTIONS, actingOnMatches } from "./match_actions.js";
import { matchNextStep, startMatches } from "./match_desk.js";
import { startMatchLines } from "./match_lines.js";
import { FieldPage } from "../fields/panels/field_page.js";
import { MatchDesk } from "./panels/match_desk.js";
import { MatchList } from "./panels/match_list.js";
import { NewRig } from "./panels/new_rig.js";
import { RigForm, RigPage } from "./panels/rig.js";
import { MatchReport, RigReport } from "./panels/rig_report.js";
import { rigNextStep, startRig } from "./rig.js";
import { TRACK_ACTIONS, startTracks } from "./tracks.js";

/**
 * @typedef {import("../../core/features.js").Feature<"new-rig" | "rig">} Rigs
 * @typedef {import("../../core/features.js").Feature<"match" | "former-pair">} Matches
 * @type {{ rigs: Rigs, matches: Matches, tracks: import("../../core/features.js").Feature }}
 */
export const rig = {
  rigs: {
    actions: RIG_ACTIONS,
    start: [startRig, startTracks],
    views: {
      "new-rig": {
        addresses: ["field/new/:field", "field/new"],
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
  matches: {
    actions: MATCH_ACTIONS,
    adapt: actingOnMatches,
    start: [startMatches, startMatchLines, startFormerPairs],
    views: {
      match: {
        addresses: ["field/rigs/:rig/:left/:right"],
        label: t("rig.match.title"),
        Form: MatchList,
        Main: MatchDesk,
        Report: MatchReport,
        behind: "field",
        nextStep: matchNextStep,
      },
      "former-pair": {
        addresses: ["field/pairs/:left/:right"],
        label: t("shell.place.field"),
        Main: FieldPage,
        behind: "field",
      },
    },
    jobs: { pair: t("jobs.kind.pair") },
  },
  tracks: { actions: TRACK_ACTIONS },
};
