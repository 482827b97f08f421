// Actions on a live camera: take its picture, confirm it, try and save its source.
import { route } from "../../core/route.js";
import { t } from "../../core/words.js";
import { takePicture } from "../calibrate/pictures.js";
import {
  confirmCamera,
  form,
  openedCamera,
  saveCamera,
  sourceTest,
  status,
  testedSource,
  tryCamera,
} from "./camera_page.js";
import { toggleWallLines, wallLines } from "./wall.js";

const STILL_FRAMES = 25;
const isLive = () => status.value?.state === "live" || status.value?.state === "mismatch";

/** @type {import("../../core/actions.js").Action[]} */
export const LIVE_ACTIONS = [
  {
    id: "take-live",
    label: t("live.action.take-live"),
    short: t("live.action.take-live.short"),
    group: "pictures",
    run: () => void takePicture(openedCamera.value?.id ?? ""),
    enabled: () => isLive(),
  },
  {
    id: "take-still",
    label: t("live.action.take-still"),
    short: t("live.action.take-still.short"),
    group: "pictures",
    run: () => void takePicture(openedCamera.value?.id ?? "", STILL_FRAMES),
    enabled: () => isLive(),
  },
  {
    id: "confirm-camera",
    label: t("live.action.confirm-camera"),
    group: "pictures",
    run: () => void confirmCamera(),
    enabled: () => status.value?.problem?.reason === "other-camera",
  },
  {
    id: "wall-lines",
    label: t("live.action.wall-lines"),
    short: t("live.field-lines"),
    group: "pictures",
    run: toggleWallLines,
    enabled: () => route.value.view === "wall",
    pressed: () => wallLines.value,
  },
  {
    id: "try-camera",
    label: t("live.action.try-camera"),
    short: t("live.action.try-camera.short"),
    group: "pictures",
    run: () => void tryCamera(),
    enabled: () => Boolean(form.value?.values.source) && sourceTest.value === null,
  },
  {
    id: "keep-camera",
    label: t("live.action.keep-camera"),
    group: "pictures",
    run: () => void saveCamera(),
    enabled: () =>
      Boolean(form.value?.values.id) && testedSource.value?.source === form.value?.values.source,
  },
];
