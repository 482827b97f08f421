// Actions on live detection.
import { go } from "../../core/route.js";
import { t } from "../../core/words.js";
import { openedCamera as liveShown } from "../live/camera_page.js";
import { nextFrame, play, playing, previousFrame, recordClip, recording } from "./clips.js";
import { COLOURS, choose, colour, learnAutomatically, learning, colourName } from "./colours.js";
import {
  detectionCamera,
  detectionState,
  future,
  past,
  redoDetection,
  undoDetection,
} from "./detection.js";
import { MASK, canCorrect, labels, toggleView, view, zoom, zoomDisplay } from "./display.js";
import { heldFrame, holdFrame, releaseFrame, taking } from "./held_frame.js";

const here = () => detectionCamera.value !== null && detectionState.value !== null;

/** @type {import("../../core/actions.js").Action[]} */
export const DETECTION_ACTIONS = [
  {
    id: "seeing",
    label: t("detection.action.seeing"),
    short: t("detection.action.seeing.short"),
    keys: ["F9"],
    group: "pictures",
    run: () => go("detection", { camera: liveShown.value?.id }),
    enabled: () => liveShown.value !== null,
  },
  {
    id: "hold-frame",
    label: t("detection.action.hold-frame"),
    short: t("detection.action.hold-frame.short"),
    keys: [" "],
    group: "detection",
    run: () => {
      if (heldFrame.value) releaseFrame();
      else void holdFrame();
    },
    enabled: () => here() && !taking.value,
    pressed: () => heldFrame.value !== null,
  },
  {
    id: "next-frame",
    label: t("detection.action.next-frame"),
    short: t("detection.action.next-frame.short"),
    keys: ["."],
    group: "detection",
    run: nextFrame,
    enabled: () => here() && heldFrame.value !== null && !taking.value,
  },
  {
    id: "previous-frame",
    label: t("detection.action.previous-frame"),
    short: t("detection.action.previous-frame.short"),
    keys: [","],
    group: "detection",
    run: previousFrame,
    enabled: () => here() && Boolean(heldFrame.value?.clip && heldFrame.value.number > 0),
  },
  {
    id: "play-clip",
    label: t("detection.action.play-clip"),
    short: t("detection.action.play-clip.short"),
    keys: ["p"],
    group: "detection",
    run: play,
    enabled: () => here() && Boolean(heldFrame.value?.clip),
    pressed: () => playing.value,
  },
  {
    id: "record-clip",
    label: t("detection.action.record-clip"),
    short: t("detection.action.record-clip.short"),
    keys: ["r"],
    group: "detection",
    run: () => void recordClip(),
    enabled: () => here() && recording.value === null,
  },
  {
    id: "stop-recording",
    label: t("detection.action.stop-recording"),
    short: t("common.stop"),
    group: "detection",
    run: () => recording.value?.stop.abort(),
    enabled: () => recording.value !== null,
  },
  {
    id: "mask",
    label: t("detection.action.mask"),
    short: t("detection.action.mask.short"),
    keys: ["m"],
    group: "detection",
    run: () => toggleView(MASK),
    enabled: here,
    pressed: () => view.value === MASK,
  },
  {
    id: "seen-corrected",
    label: t("detection.action.seen-corrected"),
    short: t("common.corrected"),
    keys: ["v"],
    group: "detection",
    run: () => toggleView("corrected"),
    enabled: () => here() && canCorrect.value && !heldFrame.value,
    pressed: () => view.value === "corrected",
  },
  {
    id: "seen-labels",
    label: t("detection.action.seen-labels"),
    short: t("detection.action.seen-labels.short"),
    keys: ["l"],
    group: "detection",
    run: () => {
      labels.value = !labels.value;
    },
    enabled: here,
    pressed: () => labels.value,
  },
  {
    id: "seen-nearer",
    label: t("detection.action.seen-nearer"),
    short: "+",
    keys: ["+", "="],
    group: "detection",
    run: () => zoomDisplay(1),
    enabled: here,
  },
  {
    id: "seen-farther",
    label: t("detection.action.seen-farther"),
    short: "−",
    keys: ["-"],
    group: "detection",
    run: () => zoomDisplay(-1),
    enabled: () => here() && zoom.value > 1,
  },
  {
    id: "seen-whole",
    label: t("detection.action.seen-whole"),
    short: t("detection.action.seen-whole.short"),
    keys: ["0"],
    group: "detection",
    run: () => {
      zoom.value = 1;
    },
    enabled: () => here() && zoom.value > 1,
  },
  {
    id: "find-colours",
    label: t("detection.action.find-colours"),
    short: t("detection.action.find-colours.short"),
    group: "detection",
    run: learnAutomatically,
    enabled: () => here() && learning.value === null,
  },
  {
    id: "stop-learning",
    label: t("detection.action.stop-learning"),
    short: t("common.stop"),
    group: "detection",
    run: () => learning.value?.stop.abort(),
    enabled: () => learning.value !== null,
  },
  ...COLOURS.map(([name], i) => ({
    id: `colour-${name}`,
    label: t("detection.action.colour", { colour: colourName(name) }),
    keys: [String(i + 1)],
    group: /** @type {const} */ ("detection"),
    run: () => choose(name),
    enabled: here,
    pressed: () => colour.value === name,
  })),
  {
    id: "stop-picking",
    label: t("detection.action.stop-picking"),
    keys: ["Escape"],
    group: "detection",
    run: () => choose(colour.value),
    enabled: () => here() && colour.value !== "",
  },
  {
    id: "undo-seeing",
    label: t("detection.action.undo-seeing"),
    short: t("common.undo"),
    keys: ["ctrl+z"],
    group: "detection",
    run: undoDetection,
    enabled: () => here() && past.value.length > 0,
  },
  {
    id: "redo-seeing",
    label: t("detection.action.redo-seeing"),
    short: t("common.redo"),
    keys: ["ctrl+y", "ctrl+shift+z"],
    group: "detection",
    run: redoDetection,
    enabled: () => here() && future.value.length > 0,
  },
];
