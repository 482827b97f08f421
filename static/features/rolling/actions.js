// Actions on a rolling ball.
import { go } from "../../core/route.js";
import { openedCamera as liveShown } from "../live/camera_page.js";
import {
  canInclude,
  counted,
  excludeNewest,
  fitFromRolls,
  forgetRolls,
  hasCorrected,
  includeRolls,
  rolls,
  rollsCamera,
  search,
  view,
  wantsCorrected,
} from "./rolls.js";

/** @type {import("../../core/actions.js").Action[]} */
export const ROLLING_ACTIONS = [
  {
    id: "watch-rolls",
    label: "Let a ball roll before this camera…",
    short: "Let a ball roll…",
    group: "Pictures",
    run: () => go("ball", { camera: liveShown.value?.id }),
    enabled: () => liveShown.value !== null,
  },
  {
    id: "leave-roll",
    label: "Leave the newest roll out",
    short: "Leave the newest out",
    keys: ["u"],
    group: "Pictures",
    run: excludeNewest,
    enabled: () => rollsCamera.value !== null && counted.value.length > 0,
  },
  {
    id: "take-roll",
    label: "Take the roll in again that was left out last",
    short: "Take it in again",
    keys: ["ctrl+z"],
    group: "Pictures",
    run: includeRolls,
    enabled: () => rollsCamera.value !== null && canInclude.value,
  },
  {
    id: "roll-view",
    label: "Judge rolls in the corrected picture, or in the raw one",
    short: "Corrected",
    keys: ["v"],
    group: "Pictures",
    run: () => {
      wantsCorrected.value = view.value === "raw";
    },
    enabled: () => rollsCamera.value !== null && hasCorrected.value,
    pressed: () => view.value === "corrected",
  },
  {
    id: "forget-rolls",
    label: "Forget all rolls of this camera…",
    short: "Forget all…",
    group: "Pictures",
    run: () => void forgetRolls(),
    enabled: () => rollsCamera.value !== null && rolls.value.length > 0,
  },
  {
    id: "fit-rolls",
    label: "Fit the lens from these rolls",
    short: "Fit the lens",
    group: "Pictures",
    run: () => void fitFromRolls("lens"),
    enabled: () => rollsCamera.value !== null && counted.value.length >= 3 && search.value === null,
  },
  {
    id: "refine-rolls",
    label: "Refine the active calibration by these rolls, as a new version",
    short: "Refine the calibration",
    group: "Pictures",
    run: () => void fitFromRolls("refined"),
    enabled: () =>
      rollsCamera.value !== null && counted.value.length >= 3 && search.value === null && hasCorrected.value,
  },
  {
    id: "stop-rolls",
    label: "Stop fitting the rolls",
    short: "Stop",
    group: "Pictures",
    run: () => search.value?.stop.abort(),
    enabled: () => search.value !== null,
  },
];
