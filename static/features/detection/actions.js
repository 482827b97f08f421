// Actions on live detection.
import { go } from "../../core/route.js";
import { openedCamera as liveShown } from "../live/camera_page.js";
import { nextFrame, play, playing, previousFrame, recordClip, recording } from "./clips.js";
import { COLOURS, choose, colour, learnAutomatically, learning } from "./colours.js";
import { detectionCamera, detectionState, future, past, redoDetection, undoDetection } from "./detection.js";
import { MASK, canCorrect, labels, toggleView, view, zoom, zoomDisplay } from "./display.js";
import { heldFrame, holdFrame, releaseFrame, taking } from "./held_frame.js";

const here = () => detectionCamera.value !== null && detectionState.value !== null;

/** @type {import("../../core/actions.js").Action[]} */
export const DETECTION_ACTIONS = [
  {
    id: "seeing",
    label: "Show what this camera sees: ball, robots, colours, stages",
    short: "What it sees…",
    keys: ["F9"],
    group: "Pictures",
    run: () => go("detection", { camera: liveShown.value?.id }),
    enabled: () => liveShown.value !== null,
  },
  {
    id: "hold-frame",
    label: "Hold the frame of now, or go on",
    short: "Hold",
    keys: [" "],
    group: "Seeing",
    run: () => {
      if (heldFrame.value) releaseFrame();
      else void holdFrame();
    },
    enabled: () => here() && !taking.value,
    pressed: () => heldFrame.value !== null,
  },
  {
    id: "next-frame",
    label: "Hold the next frame",
    short: "Next frame",
    keys: ["."],
    group: "Seeing",
    run: nextFrame,
    enabled: () => here() && heldFrame.value !== null && !taking.value,
  },
  {
    id: "previous-frame",
    label: "Show the frame before in the clip",
    short: "Frame before",
    keys: [","],
    group: "Seeing",
    run: previousFrame,
    enabled: () => here() && Boolean(heldFrame.value?.clip && heldFrame.value.number > 0),
  },
  {
    id: "play-clip",
    label: "Play the clip, or stop there",
    short: "Play",
    keys: ["p"],
    group: "Seeing",
    run: play,
    enabled: () => here() && Boolean(heldFrame.value?.clip),
    pressed: () => playing.value,
  },
  {
    id: "record-clip",
    label: "Record five seconds of this camera",
    short: "Record 5 s",
    keys: ["r"],
    group: "Seeing",
    run: () => void recordClip(),
    enabled: () => here() && recording.value === null,
  },
  {
    id: "stop-recording",
    label: "Stop recording; nothing is kept",
    short: "Stop",
    group: "Seeing",
    run: () => recording.value?.stop.abort(),
    enabled: () => recording.value !== null,
  },
  {
    id: "mask",
    label: "Show which colour each pixel is taken for, or the picture",
    short: "Mask",
    keys: ["m"],
    group: "Seeing",
    run: () => toggleView(MASK),
    enabled: here,
    pressed: () => view.value === MASK,
  },
  {
    id: "seen-corrected",
    label: "Show what is seen in the corrected picture, or in the raw one",
    short: "Corrected",
    keys: ["v"],
    group: "Seeing",
    run: () => toggleView("corrected"),
    enabled: () => here() && canCorrect.value && !heldFrame.value,
    pressed: () => view.value === "corrected",
  },
  {
    id: "seen-labels",
    label: "Write field millimetres beside what is seen",
    short: "Millimetres",
    keys: ["l"],
    group: "Seeing",
    run: () => {
      labels.value = !labels.value;
    },
    enabled: here,
    pressed: () => labels.value,
  },
  {
    id: "seen-nearer",
    label: "Look nearer at what is seen",
    short: "+",
    keys: ["+", "="],
    group: "Seeing",
    run: () => zoomDisplay(1),
    enabled: here,
  },
  {
    id: "seen-farther",
    label: "Look from farther at what is seen",
    short: "−",
    keys: ["-"],
    group: "Seeing",
    run: () => zoomDisplay(-1),
    enabled: () => here() && zoom.value > 1,
  },
  {
    id: "seen-whole",
    label: "Look at the whole picture of what is seen",
    short: "Fit",
    keys: ["0"],
    group: "Seeing",
    run: () => {
      zoom.value = 1;
    },
    enabled: () => here() && zoom.value > 1,
  },
  {
    id: "find-colours",
    label: "Find the colours by themselves in the picture",
    short: "Find them by themselves",
    group: "Seeing",
    run: learnAutomatically,
    enabled: () => here() && learning.value === null,
  },
  {
    id: "stop-learning",
    label: "Stop learning colours",
    short: "Stop",
    group: "Seeing",
    run: () => learning.value?.stop.abort(),
    enabled: () => learning.value !== null,
  },
  ...COLOURS.map(([name], i) => ({
    id: `colour-${name}`,
    label: `Teach ${name} by clicks, or stop that`,
    keys: [String(i + 1)],
    group: "Seeing",
    run: () => choose(name),
    enabled: here,
    pressed: () => colour.value === name,
  })),
  {
    id: "stop-picking",
    label: "Stop teaching a colour",
    keys: ["Escape"],
    group: "Seeing",
    run: () => choose(colour.value),
    enabled: () => here() && colour.value !== "",
  },
  {
    id: "undo-seeing",
    label: "Undo the last change of colours or stages",
    short: "Undo",
    keys: ["ctrl+z"],
    group: "Seeing",
    run: undoDetection,
    enabled: () => here() && past.value.length > 0,
  },
  {
    id: "redo-seeing",
    label: "Redo the change of colours or stages",
    short: "Redo",
    keys: ["ctrl+y", "ctrl+shift+z"],
    group: "Seeing",
    run: redoDetection,
    enabled: () => here() && future.value.length > 0,
  },
];
