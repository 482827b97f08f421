// The next step of each view beside calibrating and the wall.
import { computed } from "@preact/signals";
import { route } from "../../core/route.js";
import { isNowhere } from "../../core/state.js";
import { t } from "../../core/words.js";
import { boardNextStep } from "../board/board.js";
import { captureNextStep } from "../board/capture.js";
import { detectionNextStep } from "../detection/detection.js";
import { driftNextStep } from "../drift/drift.js";
import { editorNextStep } from "../field_editor/editor.js";
import { cameraNextStep, formNextStep } from "../live/camera_page.js";
import { matchNextStep } from "../rig/match_desk.js";
import { rigNextStep } from "../rig/rig.js";
import { rollsNextStep } from "../rolling/rolls.js";
import { sceneNextStep } from "../scene/scene.js";
import { straightNextStep } from "../straight/straight.js";

const nowhereNextStep = computed(() => ({
  action: "step-camera",
  label: t("shell.back-to-cameras"),
  missing: "",
  done: false,
  sentence: t("shell.nowhere.sentence"),
}));

/** @typedef {import("@preact/signals").ReadonlySignal<{ action: string, label: string, missing: string, done: boolean,
 * sentence: string }>} NextStep */

/** Views that are not here show lists: nothing in them is the next thing to do.
 * @type {Partial<Record<import("../../core/route.js").View, NextStep>>} */
const NEXT_STEPS = {
  "new-camera": formNextStep,
  "camera-form": formNextStep,
  live: cameraNextStep,
  "camera-images": cameraNextStep,
  drift: driftNextStep,
  detection: detectionNextStep,
  "new-rig": rigNextStep,
  rig: rigNextStep,
  match: matchNextStep,
  scene: sceneNextStep,
  board: boardNextStep,
  capture: captureNextStep,
  edges: straightNextStep,
  ball: rollsNextStep,
  "new-field": editorNextStep,
  "field-editor": editorNextStep,
};

/** Of the view that is shown; null where there is none, on the wall, and while calibrating. */
export const viewNextStep = computed(() => {
  const { view } = route.value;
  if (view === "nowhere" || isNowhere.value) return nowhereNextStep.value;
  return NEXT_STEPS[view]?.value ?? null;
});
