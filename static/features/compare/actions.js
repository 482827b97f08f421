// Actions on a comparison of raw and corrected, still or live.
import { compare, comparing, editing } from "../../core/state.js";
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
  { id: "raw", label: "Show the raw picture", short: "Raw", key: "r" },
  { id: "wipe", label: "Wipe between raw and corrected", short: "Wipe", key: "w" },
  { id: "corrected", label: "Show the corrected picture", short: "Corrected", key: "c" },
  { id: "side", label: "Show raw and corrected side by side", short: "Side", key: "s" },
  { id: "blink", label: "Blink between raw and corrected", short: "Blink", key: "k" },
];

/** @type {import("../../core/actions.js").Action[]} */
export const COMPARE_ACTIONS = [
  ...MODES.map(({ id, label, short, key }) => ({
    id,
    label,
    short,
    keys: [key],
    group: "Compare",
    run: () => setCompareMode(id),
    enabled: has,
    pressed: () => mode.value === id,
  })),
  {
    id: "flip",
    label: "Show the other picture while the key is held",
    keys: ["f"],
    group: "Compare",
    run: (event) => hold(event),
    enabled: () => both() && visiblePicture.value !== "side" && visiblePicture.value !== "wipe",
  },
  {
    id: "swap",
    label: "Swap the two pictures once",
    short: "Swap",
    keys: ["j"],
    group: "Compare",
    run: swap,
    enabled: () => both() && mode.value === "blink",
  },
  {
    id: "blink-pause",
    label: "Let them blink, or stop it",
    short: "Pause",
    keys: ["u"],
    group: "Compare",
    run: pause,
    enabled: () => both() && mode.value === "blink",
  },
  {
    id: "grid",
    label: "Lay a grid of field millimetres over both pictures",
    short: "Grid",
    keys: ["g"],
    group: "Compare",
    run: () => {
      grid.value = { ...grid.value, on: !grid.value.on };
    },
    enabled: isSaved,
    pressed: () => grid.value.on,
  },
  {
    id: "worst-place",
    label: "Show the worst place of the map",
    short: "Show the worst place",
    keys: ["x"],
    group: "Compare",
    run: centreWorstPlace,
    enabled: () => heatMap.value !== null,
  },
  {
    id: "cure-worst",
    label: "Go where one more click helps the worst place most",
    short: "Click there…",
    group: "Compare",
    run: goToNextClick,
    enabled: () => heatMap.value?.what === "expected",
  },
];
