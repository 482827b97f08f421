// Cameras: all of them, one of them live, and its form.
import { t } from "../../core/words.js";
import { Readiness } from "../shell/panels/readiness.js";
import { LIVE_ACTIONS } from "./actions.js";
import { cameraNextStep, formNextStep, isEditable, startCameraForm } from "./camera_page.js";
import { CameraForm, SourceHelp, Tried } from "./panels/camera_form.js";
import { CameraPage, CameraPanel, CameraReport } from "./panels/camera_page.js";
import { Wall } from "./panels/wall.js";

const FORM = { Form: SourceHelp, Main: CameraForm, Report: Tried, nextStep: formNextStep };

/** @type {import("../../core/features.js").Feature<"wall" | "new-camera" | "live" | "camera-form">} */
export const live = {
  actions: LIVE_ACTIONS,
  start: [startCameraForm],
  views: {
    wall: {
      addresses: ["cameras"],
      label: t("shell.place.cameras"),
      Main: Wall,
      Report: Readiness,
    },
    "new-camera": { addresses: ["cameras/new"], label: t("shell.view.new-camera"), ...FORM },
    live: {
      addresses: ["cameras/:camera/live"],
      label: t("shell.view.live"),
      Form: CameraPanel,
      Main: CameraPage,
      Report: CameraReport,
      tabs: { cameras: 1 },
      nextStep: cameraNextStep,
    },
    "camera-form": {
      addresses: ["cameras/:camera/settings"],
      label: t("shell.view.camera-form"),
      ...FORM,
      hasPanels: isEditable,
      tabs: { cameras: 6 },
    },
  },
};
