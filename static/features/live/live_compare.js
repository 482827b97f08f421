// A camera's live picture, raw against corrected: which calibration is applied, and where the pictures lie.
import { computed, effect, signal, untracked } from "@preact/signals";
import { call } from "../../core/api.js";
import { notifyError } from "../../core/state.js";
import { correctsHere } from "../../canvas/graphics.js";
import { createViewport } from "../../canvas/viewport.js";
import { atLive, cameraView, openedCamera, status } from "./camera_page.js";

/** The camera's own picture, in raw pixels of its calibration. */
export const liveView = createViewport();
/** Where the pointer is, in raw pixels. */
export const livePointer = signal(/** @type {{ x: number, y: number } | null} */ (null));
/** Corrected pixels around the field, as the stream shows them. */
export const liveMargin = signal(0);

const fetched = signal(/** @type {import("../../core/types").Calibration | null} */ (null));

/** Whether both pictures of a live camera are in sight, or the corrected one that this browser makes of the raw one. */
export const isTwofold = computed(
  () =>
    atLive.value &&
    openedCamera.value !== null &&
    status.value?.calibration_applied === true &&
    cameraView.value.view !== "raw" &&
    (cameraView.value.view !== "corrected" || correctsHere.value),
);

/** The calibration that is applied to the camera whose pictures are compared. */
export const liveRecord = computed(() =>
  isTwofold.value && fetched.value?.id === status.value?.active_calibration ? fetched.value : null,
);

/** Fetch the calibration of the camera that is compared, from now on. */
export function startLiveComparing() {
  effect(() => {
    const id = isTwofold.value ? status.value?.active_calibration : null;
    untracked(() => {
      if (id && fetched.value?.id !== id)
        call("GET", `/calibrations/${id}`).then((it) => {
          fetched.value = it;
        }, notifyError);
    });
  });
}
