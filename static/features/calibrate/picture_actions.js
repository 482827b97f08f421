// Actions that bring a picture to the page, and that turn its field.
import { filePicker } from "../../core/actions.js";
import { change, doc } from "../../core/document.js";
import { nextCamera, region, rotation, snapshot } from "../../core/state.js";
import { backgroundProgress, takePicture } from "./pictures.js";

/** @type {import("../../core/actions.js").Action[]} */
export const PICTURE_ACTIONS = [
  { id: "open", label: "Open a picture…", keys: ["o"], group: "Pictures", run: () => filePicker.open() },
  {
    id: "take",
    label: "Take a new picture with the same camera",
    short: "Take a new picture",
    group: "Pictures",
    run: () => void takePicture(snapshot.value?.camera ?? nextCamera.value?.id ?? ""),
    enabled: () => Boolean(snapshot.value?.camera ?? nextCamera.value),
  },
  {
    id: "stop-watching",
    label: "Stop watching; nothing is kept",
    short: "Stop",
    group: "Pictures",
    run: () => backgroundProgress.value?.stop.abort(),
    enabled: () => backgroundProgress.value !== null,
  },
];

/** @type {import("../../core/actions.js").Action[]} */
export const FIELD_ACTIONS = [
  {
    id: "turn",
    label: "Rotate the field by 90°",
    short: "Rotate 90°",
    keys: ["t"],
    group: "Pictures",
    run: () => change({ ...doc.value, rotate: (rotation.value + 90) % 360 }),
    enabled: () => region.value !== null,
  },
];
