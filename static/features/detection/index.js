// Robots and ball in a camera's picture: frames, clips and colours.
import { t } from "../../core/words.js";
import { DETECTION_ACTIONS } from "./actions.js";
import { startClips } from "./clips.js";
import { startColours } from "./colours.js";
import { detectionNextStep, startDetection } from "./detection.js";
import { startDisplay } from "./display.js";
import { startFieldPositions } from "./field_positions.js";
import { startHeldFrame } from "./held_frame.js";
import { DetectionForm } from "./panels/colours.js";
import { DetectionPage } from "./panels/detection_page.js";
import { DetectionReport } from "./panels/detections.js";

/** @type {import("../../core/features.js").Feature<"detection">} */
export const detection = {
  actions: DETECTION_ACTIONS,
  start: [
    startHeldFrame,
    startDetection,
    startColours,
    startClips,
    startFieldPositions,
    startDisplay,
  ],
  views: {
    detection: {
      addresses: ["cameras/:camera/detection"],
      label: t("shell.view.detection"),
      Form: DetectionForm,
      Main: DetectionPage,
      Report: DetectionReport,
      tabs: { cameras: 4 },
      nextStep: detectionNextStep,
    },
  },
};
