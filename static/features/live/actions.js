// Actions on a live camera: take its picture, confirm it, try and save its source.
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

const STILL_FRAMES = 25;
const isLive = () => status.value?.state === "live" || status.value?.state === "mismatch";

/** @type {import("../../core/actions.js").Action[]} */
export const LIVE_ACTIONS = [
  {
    id: "take-live",
    label: "Take a picture with this camera",
    short: "Take a picture",
    group: "Pictures",
    run: () => void takePicture(openedCamera.value?.id ?? ""),
    enabled: () => isLive(),
  },
  {
    id: "take-still",
    label: "Take the background of 25 frames, without people and robots that move",
    short: "Take it without what moves",
    group: "Pictures",
    run: () => void takePicture(openedCamera.value?.id ?? "", STILL_FRAMES),
    enabled: () => isLive(),
  },
  {
    id: "confirm-camera",
    label: "Confirm that it is the camera that was calibrated",
    group: "Pictures",
    run: () => void confirmCamera(),
    enabled: () => status.value?.problem?.reason === "other-camera",
  },
  {
    id: "try-camera",
    label: "Try this source",
    short: "Try it",
    group: "Pictures",
    run: () => void tryCamera(),
    enabled: () => Boolean(form.value?.values.source) && sourceTest.value === null,
  },
  {
    id: "keep-camera",
    label: "Keep this camera",
    group: "Pictures",
    run: () => void saveCamera(),
    enabled: () => Boolean(form.value?.values.id) && testedSource.value?.source === form.value?.values.source,
  },
];
