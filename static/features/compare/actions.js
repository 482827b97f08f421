// Actions on a comparison of raw and corrected, still or live.
import { compare, comparing, editing } from "../../core/state.js";
import { t } from "../../core/words.js";
import { isOurs } from "../../canvas/graphics.js";
import { centreWorstPlace, goToNextClick } from "../calibrate/warning_fixes.js";
import { preview, refusal } from "../calibrate/fitting.js";
import { atLive, cameraView, status } from "../live/camera_page.js";
import { version } from "../versions/versions.js";
import { hold, pause, swap } from "./blink.js";
import { compared, comparedVersion, mode, visiblePicture } from "./comparison.js";
import { grid } from "./grid.js";
import { shownMap as heatMap } from "./heat.js";

/** @typedef {import("../../core/types").CompareMode} CompareMode */

const has = () =>
  atLive.value
    ? status.value?.calibration_applied === true
    : editing.value
      ? isOurs.value && preview.value !== null && refusal.value === null
      : comparing.value && version.value !== null;
/** Whether both pictures are there. */
const both = () => compared.value !== null;
/** Whether they are of a version that the server knows. */
const isSaved = () => comparedVersion.value !== null;

/** While points are clicked, the same once more is the raw picture again. @param {CompareMode} to */
export function setCompareMode(to) {
  if (atLive.value) cameraView.value = { ...cameraView.value, view: to };
  else if (editing.value)
    compare.value = { ...compare.value, editing: compare.value.editing === to ? "raw" : to };
  else compare.value = { ...compare.value, mode: to };
}

/** @type {{ id: CompareMode, label: string, short: string, key: string }[]} */
const MODES = [
  { id: "raw", label: t("compare.action.raw.label"), short: t("common.raw"), key: "r" },
  { id: "wipe", label: t("common.wipe"), short: t("compare.action.wipe.short"), key: "w" },
  {
    id: "corrected",
    label: t("compare.action.corrected.label"),
    short: t("common.corrected"),
    key: "c",
  },
  {
    id: "side",
    label: t("compare.action.side.label"),
    short: t("compare.action.side.short"),
    key: "s",
  },
  { id: "blink", label: t("compare.action.blink.label"), short: t("common.blink"), key: "k" },
];

/** @type {import("../../core/actions.js").Action[]} */
export const COMPARE_ACTIONS = [
  ...MODES.map(({ id, label, short, key }) => ({
    id,
    label,
    short,
    keys: [key],
    group: /** @type {const} */ ("compare"),
    run: () => setCompareMode(id),
    enabled: has,
    pressed: () => mode.value === id,
  })),
  {
    id: "flip",
    label: t("compare.action.flip.label"),
    keys: ["f"],
    group: "compare",
    run: (event) => hold(event),
    enabled: () => both() && visiblePicture.value !== "side" && visiblePicture.value !== "wipe",
  },
  {
    id: "swap",
    label: t("compare.action.swap.label"),
    short: t("compare.action.swap.short"),
    keys: ["j"],
    group: "compare",
    run: swap,
    enabled: () => both() && mode.value === "blink",
  },
  {
    id: "blink-pause",
    label: t("compare.action.blink-pause.label"),
    short: t("compare.action.blink-pause.short"),
    keys: ["u"],
    group: "compare",
    run: pause,
    enabled: () => both() && mode.value === "blink",
  },
  {
    id: "grid",
    label: t("compare.action.grid.label"),
    short: t("compare.action.grid.short"),
    keys: ["g"],
    group: "compare",
    run: () => {
      grid.value = { ...grid.value, on: !grid.value.on };
    },
    enabled: isSaved,
    pressed: () => grid.value.on,
  },
  {
    id: "worst-place",
    label: t("compare.action.worst-place.label"),
    short: t("compare.action.worst-place.short"),
    keys: ["x"],
    group: "compare",
    run: centreWorstPlace,
    enabled: () => heatMap.value !== null,
  },
  {
    id: "cure-worst",
    label: t("compare.action.cure-worst.label"),
    short: t("compare.action.cure-worst.short"),
    group: "compare",
    run: goToNextClick,
    enabled: () => heatMap.value?.what === "expected",
  },
];
