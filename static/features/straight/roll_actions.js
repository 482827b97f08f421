// Actions on a rolling ball.
import { go } from "../../core/route.js";
import { t } from "../../core/words.js";
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
export const ROLL_ACTIONS = [
  {
    id: "watch-rolls",
    label: t("rolling.action.watch-rolls"),
    short: t("rolling.action.watch-rolls.short"),
    group: "pictures",
    run: () => go("ball", { camera: liveShown.value?.id }),
    enabled: () => liveShown.value !== null,
  },
  {
    id: "leave-roll",
    label: t("rolling.action.leave-roll"),
    short: t("rolling.action.leave-roll.short"),
    keys: ["u"],
    group: "pictures",
    run: excludeNewest,
    enabled: () => rollsCamera.value !== null && counted.value.length > 0,
  },
  {
    id: "take-roll",
    label: t("rolling.action.take-roll"),
    short: t("rolling.action.take-roll.short"),
    keys: ["ctrl+z"],
    group: "pictures",
    run: includeRolls,
    enabled: () => rollsCamera.value !== null && canInclude.value,
  },
  {
    id: "roll-view",
    label: t("rolling.action.roll-view"),
    short: t("common.corrected"),
    keys: ["v"],
    group: "pictures",
    run: () => {
      wantsCorrected.value = view.value === "raw";
    },
    enabled: () => rollsCamera.value !== null && hasCorrected.value,
    pressed: () => view.value === "corrected",
  },
  {
    id: "forget-rolls",
    label: t("rolling.action.forget-rolls"),
    short: t("rolling.forget-all"),
    group: "pictures",
    run: () => void forgetRolls(),
    enabled: () => rollsCamera.value !== null && rolls.value.length > 0,
  },
  {
    id: "fit-rolls",
    label: t("rolling.action.fit-rolls"),
    short: t("rolling.fit-lens"),
    group: "pictures",
    run: () => void fitFromRolls("lens"),
    enabled: () => rollsCamera.value !== null && counted.value.length >= 3 && search.value === null,
  },
  {
    id: "refine-rolls",
    label: t("rolling.action.refine-rolls"),
    short: t("rolling.action.refine-rolls.short"),
    group: "pictures",
    run: () => void fitFromRolls("refined"),
    enabled: () =>
      rollsCamera.value !== null &&
      counted.value.length >= 3 &&
      search.value === null &&
      hasCorrected.value,
  },
  {
    id: "stop-rolls",
    label: t("rolling.action.stop-rolls"),
    short: t("common.stop"),
    group: "pictures",
    run: () => search.value?.stop.abort(),
    enabled: () => search.value !== null,
  },
];
