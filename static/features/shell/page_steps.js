// The next step on each page beside the six steps, by the page's name.
import { computed } from "@preact/signals";
import { page } from "../../core/page.js";
import { captureNextStep } from "../board/capture.js";
import { detectionNextStep } from "../detection/detection.js";
import { jobsNextStep } from "../jobs/job_list.js";
import { rigNextStep } from "../rig/rig.js";
import { rollsNextStep } from "../rolling/rolls.js";
import { sceneNextStep } from "../scene/scene.js";
import { settingsNextStep } from "../settings/settings.js";
import { versionListNextStep } from "../versions/version_list.js";

const NEXT_STEPS = {
  jobs: jobsNextStep,
  settings: settingsNextStep,
  versions: versionListNextStep,
  capture: captureNextStep,
  rig: rigNextStep,
  rolls: rollsNextStep,
  scene: sceneNextStep,
  seeing: detectionNextStep,
};

export const pageNextStep = computed(() => NEXT_STEPS[page.value?.name ?? "jobs"].value);
