// How detections are displayed: which picture, at which zoom, with which labels.
import { computed, effect, signal } from "@preact/signals";
import { detectionCamera, detectionState } from "./detection.js";
import { fieldPositions } from "./field_positions.js";
import { detections } from "./held_frame.js";

const NEARER = 1.5,
  NEAREST = 8;
export const MASK = "stage-colours";

/** "raw", "corrected", or "stage-" and the name of one. */
const chosenView = signal("raw");
export const zoom = signal(1);
/** Whether field millimetres stand beside the marks; on a telephone they would hide them. */
export const labels = signal(!matchMedia("(max-width: 720px)").matches);

/** Corrected pictures are of live frames: a held one is as it was taken. */
export const canCorrect = computed(
  () => fieldPositions.value !== null && detections.value !== null,
);
export const view = computed(() => {
  const name = chosenView.value;
  if (name === "corrected") return canCorrect.value ? name : "raw";
  return !name.startsWith("stage-") ||
    detectionState.value?.plan.stages.some((s) => `stage-${s.stage}` === name)
    ? name
    : "raw";
});

/** @param {string} name */
export const setView = (name) => {
  chosenView.value = name;
};
/** @param {string} name there, or back to the picture as it was taken */
export const toggleView = (name) => {
  chosenView.value = view.value === name ? "raw" : name;
};
/** @param {1 | -1} step */
export const zoomDisplay = (step) => {
  zoom.value = Math.min(NEAREST, Math.max(1, step > 0 ? zoom.value * NEARER : zoom.value / NEARER));
};

export function startDisplay() {
  const id = computed(() => detectionCamera.value?.id);
  effect(() => {
    if (id.value) {
      chosenView.value = "raw";
      zoom.value = 1;
    }
  });
}
