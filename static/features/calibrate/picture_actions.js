// Actions that bring a picture to the page, and that turn its field.
import { filePicker } from "../../core/actions.js";
import { nextCamera, region, rotation, snapshot } from "../../core/state.js";
import { t } from "../../core/words.js";
import { changePlace } from "../automatic/find_lines.js";
import { backgroundProgress, takePicture } from "./pictures.js";

/** @type {import("../../core/actions.js").Action[]} */
export const PICTURE_ACTIONS = [
  {
    id: "open",
    label: t("calibrate.picture-actions.open"),
    keys: ["o"],
    group: "pictures",
    run: () => filePicker.open(),
  },
  {
    id: "take",
    label: t("calibrate.picture-actions.take"),
    short: t("calibrate.take-picture"),
    group: "pictures",
    run: () => void takePicture(snapshot.value?.camera ?? nextCamera.value?.id ?? ""),
    enabled: () => Boolean(snapshot.value?.camera ?? nextCamera.value),
  },
  {
    id: "stop-watching",
    label: t("calibrate.picture-actions.stop-watching"),
    short: t("common.stop"),
    group: "pictures",
    run: () => backgroundProgress.value?.stop.abort(),
    enabled: () => backgroundProgress.value !== null,
  },
];

/** @type {import("../../core/actions.js").Action[]} */
export const FIELD_ACTIONS = [
  {
    id: "turn",
    label: t("calibrate.rotate-field"),
    short: t("calibrate.picture-actions.rotate.short"),
    keys: ["t"],
    group: "pictures",
    run: () => changePlace({ rotate: (rotation.value + 90) % 360 }),
    enabled: () => region.value !== null,
  },
];
