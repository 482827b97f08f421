// Known lenses: calibrated with boards, and those of earlier calibrations.
import { effect, signal, untracked } from "@preact/signals";
import { call, online } from "../../core/api.js";
import { lensOpen } from "../../core/folds.js";
import { notifyError, snapshot, step } from "../../core/state.js";
import { versions } from "../versions/versions.js";

/** From boards, newest first. */
export const lenses = signal(/** @type {import("../../core/types").Lens[]} */ ([]));
/** Calibrations of every camera, newest first. */
export const calibrations = signal(/** @type {import("../../core/types").Calibration[]} */ ([]));

const MAX_LISTED = 50; // of each kind; who has more wants one of the newest

export async function listLenses() {
  try {
    const [boards, made] = await Promise.all([
      call("GET", `/lenses?limit=${MAX_LISTED}`),
      call("GET", `/calibrations?limit=${MAX_LISTED}`),
    ]);
    lenses.value = boards.items;
    calibrations.value = made.items;
  } catch (error) {
    notifyError(error);
  }
}

/**
 * Whether a lens can be held for the picture that is worked on.
 * @param {{ model: string | { name: string }, image_size: import("../../core/types").Point }} it
 * @param {string | null} model
 */
export const isSuited = (it, model) =>
  (typeof it.model === "string" ? it.model : it.model.name) === model &&
  String(it.image_size) === `${snapshot.value?.width},${snapshot.value?.height}`;

/** Have the lists when a lens is chosen, from now on. */
export function startLenses() {
  effect(() => {
    void versions.value;
    if (step.value === "points" && lensOpen.value && online.value)
      untracked(() => void listLenses());
  });
}
