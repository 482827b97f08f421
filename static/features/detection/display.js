// How the operator looks at what a camera sees: which picture, how near, with which words in it.
import { computed, effect, signal } from "@preact/signals";
import { shown, told } from "./detection.js";
import { places } from "./field_positions.js";
import { seen } from "./held_frame.js";

const NEARER = 1.5, NEAREST = 8;
export const MASK = "stage-colours";

/** "raw", "corrected", or "stage-" and the name of one. */
const wished = signal("raw");
export const zoom = signal(1);
/** Whether field millimetres stand beside the marks; on a telephone they would hide them. */
export const labels = signal(!matchMedia("(max-width: 720px)").matches);

/** Corrected pictures are of live frames: a held one is as it was taken. */
export const canCorrect = computed(() => places.value !== null && seen.value !== null);
export const view = computed(() => {
  const name = wished.value;
  if (name === "corrected") return canCorrect.value ? name : "raw";
  return !name.startsWith("stage-") || told.value?.plan.stages.some((s) => `stage-${s.stage}` === name) ? name : "raw";
});

/** @param {string} name */
export const lookAt = (name) => { wished.value = name; };
/** @param {string} name there, or back to the picture as it was taken */
export const toggleView = (name) => { wished.value = view.value === name ? "raw" : name; };
/** @param {1 | -1} step */
export const zoomSeen = (step) => { zoom.value = Math.min(NEAREST, Math.max(1, step > 0 ? zoom.value * NEARER : zoom.value / NEARER)); };

export function startSeeingLook() {
  const id = computed(() => shown.value?.id);
  effect(() => { if (id.value) { wished.value = "raw"; zoom.value = 1; } });
}
