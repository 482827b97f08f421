// What an operator can do with a rolling ball, for the table of all actions.
import { shown as liveShown } from "../live/camera_page.js";
import { openPage } from "../shell/open_page.js";
import {
  canTakeIn, counted, forgetRolls, hasCorrected, leaveNewest, makeOfRolls, rolls, search, shown, takeInAgain, view,
  wantsCorrected,
} from "./rolls.js";

/** @type {import("../../core/actions.js").Action[]} */
export const ROLL_ACTIONS = [
  { id: "watch-rolls", label: "Let a ball roll before this camera…", short: "Let a ball roll…", group: "Pictures", run: () => openPage("rolls", liveShown.value?.id ?? ""), enabled: () => liveShown.value !== null },
  { id: "leave-roll", label: "Leave the newest roll out", short: "Leave the newest out", keys: ["u"], group: "Pictures", run: leaveNewest, enabled: () => shown.value !== null && counted.value.length > 0 },
  { id: "take-roll", label: "Take the roll in again that was left out last", short: "Take it in again", keys: ["ctrl+z"], group: "Pictures", run: takeInAgain, enabled: () => shown.value !== null && canTakeIn.value },
  { id: "roll-view", label: "Judge rolls in the corrected picture, or in the raw one", short: "Corrected", keys: ["v"], group: "Pictures", run: () => { wantsCorrected.value = view.value === "raw"; },
    enabled: () => shown.value !== null && hasCorrected.value, pressed: () => view.value === "corrected" },
  { id: "forget-rolls", label: "Forget all rolls of this camera…", short: "Forget all…", group: "Pictures", run: () => void forgetRolls(), enabled: () => shown.value !== null && rolls.value.length > 0 },
  { id: "fit-rolls", label: "Fit the lens from these rolls", short: "Fit the lens", group: "Pictures", run: () => void makeOfRolls("lens"), enabled: () => shown.value !== null && counted.value.length >= 3 && search.value === null },
  { id: "refine-rolls", label: "Refine the active calibration by these rolls, as a new version", short: "Refine the calibration", group: "Pictures", run: () => void makeOfRolls("refined"),
    enabled: () => shown.value !== null && counted.value.length >= 3 && search.value === null && hasCorrected.value },
  { id: "stop-rolls", label: "Stop fitting the rolls", short: "Stop", group: "Pictures", run: () => search.value?.stop.abort(), enabled: () => search.value !== null },
];
