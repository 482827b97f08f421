// The next step of every view beside calibrating and the start page.
import { computed } from "@preact/signals";
import { route } from "../../core/route.js";
import { isNowhere } from "../../core/state.js";
import { boardNextStep } from "../board/board.js";
import { captureNextStep } from "../board/capture.js";
import { detectionNextStep } from "../detection/detection.js";
import { jobsNextStep } from "../jobs/job_list.js";
import { cameraNextStep, formNextStep } from "../live/camera_page.js";
import { pairNextStep } from "../pair/evaluation.js";
import { rigNextStep } from "../rig/rig.js";
import { rollsNextStep } from "../rolling/rolls.js";
import { sceneNextStep } from "../scene/scene.js";
import { settingsNextStep } from "../settings/settings.js";
import { straightNextStep } from "../straight/straight.js";
import { versionListNextStep } from "../versions/version_list.js";

const nowhereNextStep = computed(() => ({
  action: "step-camera",
  label: "Back to the cameras",
  missing: "",
  done: false,
  sentence: "There is nothing at this address.",
}));

const NEXT_STEPS = {
  "new-camera": formNextStep,
  "camera-form": formNextStep,
  live: cameraNextStep,
  detection: detectionNextStep,
  versions: versionListNextStep,
  "new-rig": rigNextStep,
  rig: rigNextStep,
  pair: pairNextStep,
  scene: sceneNextStep,
  board: boardNextStep,
  capture: captureNextStep,
  edges: straightNextStep,
  ball: rollsNextStep,
  jobs: jobsNextStep,
  server: settingsNextStep,
};

/** Of the view that is shown; null at the start page and while calibrating. */
export const viewNextStep = computed(() => {
  const { view } = route.value;
  if (view === "nowhere" || isNowhere.value) return nowhereNextStep.value;
  return view === "wall" || view === "calibrate" ? null : NEXT_STEPS[view].value;
});
