// Actions that find a lens from views of a board, uploaded or taken live.
import { filePicker } from "../../core/actions.js";
import { go } from "../../core/route.js";
import { openedCamera as liveCamera } from "../live/camera_page.js";
import { atBoard, findLens, foundLens, openBoard, ready, search, useLens } from "./board.js";
import {
  automatic,
  boardView,
  captureCamera,
  findCaptured,
  switchAutomatic,
  takeView,
  views,
} from "./capture.js";

/** @type {import("../../core/actions.js").Action[]} */
export const BOARD_ACTIONS = [
  {
    id: "board",
    label: "Calibrate a lens with a board…",
    group: "Pictures",
    run: () => void openBoard(),
  },
  {
    id: "add-pictures",
    label: "Add pictures of the board…",
    group: "Pictures",
    run: () => filePicker.open(),
    enabled: () => atBoard.value,
  },
  {
    id: "find-lens",
    label: "Find the lens from the pictures of the board",
    short: "Find the lens",
    group: "Pictures",
    run: () => void findLens(),
    enabled: () => atBoard.value && ready.value.length > 0 && search.value === null,
  },
  {
    id: "stop-finding",
    label: "Stop finding the lens",
    short: "Stop",
    group: "Pictures",
    run: () => search.value?.stop.abort(),
    enabled: () => search.value !== null,
  },
  {
    id: "use-lens",
    label: "Use this lens for a camera",
    group: "Pictures",
    run: () => {
      if (foundLens.value) useLens(foundLens.value);
    },
    enabled: () => foundLens.value !== null,
  },
  {
    id: "watch-board",
    label: "Hold a board before this camera…",
    short: "Hold a board before it…",
    group: "Pictures",
    run: () => go("capture", { camera: liveCamera.value?.id }),
    enabled: () => liveCamera.value !== null,
  },
  {
    id: "capture",
    label: "Take views of the board by themselves, or stop that",
    keys: ["k"],
    group: "Pictures",
    run: switchAutomatic,
    enabled: () => captureCamera.value !== null,
    pressed: () => automatic.value,
  },
  {
    id: "take-view",
    label: "Take this view of the board",
    short: "Take this view",
    keys: [" "],
    group: "Pictures",
    run: takeView,
    enabled: () => Boolean(boardView.value?.quad),
  },
  {
    id: "find-captured",
    label: "Find the lens from the views of the board",
    short: "Find the lens",
    group: "Pictures",
    run: () => void findCaptured(),
    enabled: () => views.value.length >= 3,
  },
];
