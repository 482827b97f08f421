// Actions that find a lens from views of a board, uploaded or taken live.
import { filePicker } from "../../core/actions.js";
import { go } from "../../core/route.js";
import { t } from "../../core/words.js";
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
    label: t("board.action.board"),
    group: "pictures",
    run: () => void openBoard(),
  },
  {
    id: "add-pictures",
    label: t("board.action.add-pictures"),
    group: "pictures",
    run: () => filePicker.open(),
    enabled: () => atBoard.value,
  },
  {
    id: "find-lens",
    label: t("board.action.find-lens"),
    short: t("board.find-lens"),
    group: "pictures",
    run: () => void findLens(),
    enabled: () => atBoard.value && ready.value.length > 0 && search.value === null,
  },
  {
    id: "stop-finding",
    label: t("board.action.stop-finding"),
    short: t("common.stop"),
    group: "pictures",
    run: () => search.value?.stop.abort(),
    enabled: () => search.value !== null,
  },
  {
    id: "use-lens",
    label: t("board.action.use-lens"),
    group: "pictures",
    run: () => {
      if (foundLens.value) useLens(foundLens.value);
    },
    enabled: () => foundLens.value !== null,
  },
  {
    id: "watch-board",
    label: t("board.action.watch-board"),
    short: t("board.action.watch-board.short"),
    group: "pictures",
    run: () => go("capture", { camera: liveCamera.value?.id }),
    enabled: () => liveCamera.value !== null,
  },
  {
    id: "capture",
    label: t("board.action.capture"),
    keys: ["k"],
    group: "pictures",
    run: switchAutomatic,
    enabled: () => captureCamera.value !== null,
    pressed: () => automatic.value,
  },
  {
    id: "take-view",
    label: t("board.action.take-view"),
    short: t("board.action.take-view.short"),
    keys: [" "],
    group: "pictures",
    run: takeView,
    enabled: () => Boolean(boardView.value?.quad),
  },
  {
    id: "find-captured",
    label: t("board.action.find-captured"),
    short: t("board.find-lens"),
    group: "pictures",
    run: () => void findCaptured(),
    enabled: () => views.value.length >= 3,
  },
];
