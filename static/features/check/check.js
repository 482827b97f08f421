// Check a camera's active calibration in its present picture. Nothing is fitted or saved.
import { computed, effect, signal } from "@preact/signals";
import { runJob } from "../../core/jobs.js";
import { longWork } from "../../core/long_work.js";
import { t } from "../../core/words.js";
import { openedCamera, status } from "../live/camera_page.js";

const FRAMES = 5; // whoever walks by fast leaves the picture, and noise with them

/**
 * @typedef {{ feature: string, found_share: number, rms_mm: number | null, worst_mm: number | null, rms_px: number |
 * null }} LineChecked
 * @typedef {{ calibration: string, version: number | null, camera: string, snapshot: string, image_size: [number,
 * number], found_share: number,
 * verdict: { level: "good" | "fair" | "poor" | null, sentence: string, fix: string, reason: string }, lines:
 * LineChecked[],
 * points: { feature: string, expected: import("../../core/types").Point, found: import("../../core/types").Point,
 * off_mm: number }[] }} Checked */

const work = longWork();
/** How far the check is, and why it was refused. */
export const { search: checking, refusal: notChecked } = work;
const last = signal(/** @type {{ camera: string, found: Checked } | null} */ (null));
/** What the last check of the camera on show said; null once another version is active. */
export const checked = computed(() => {
  const it = last.value;
  return it &&
    it.camera === openedCamera.value?.id &&
    it.found.calibration === status.value?.active_calibration
    ? it.found
    : null;
});
export const canCheck = computed(
  () =>
    checking.value === null &&
    status.value?.state === "live" &&
    Boolean(status.value.active_calibration),
);

/** Take a picture and hold the active calibration against it. */
export async function checkCalibration() {
  const camera = openedCamera.value?.id,
    id = status.value?.active_calibration;
  if (!camera || !id) return;
  await work.watch(
    (stop, onProgress) =>
      runJob(`/calibrations/${id}/check?job=true`, { camera, frames: FRAMES }, stop, onProgress),
    (/** @type {Checked} */ found) => {
      last.value = { camera, found };
    },
  );
}

export function closeCheck() {
  last.value = null;
  notChecked.value = null;
}

// A refusal is of the camera that was on show.
effect(() => {
  void openedCamera.value?.id;
  notChecked.value = null;
});

/** @type {import("../../core/actions.js").Action[]} */
export const CHECK_ACTIONS = [
  {
    id: "check-calibration",
    label: t("check.action.check"),
    short: t("check.action.check.short"),
    keys: ["F4"],
    group: "pictures",
    run: () => void checkCalibration(),
    enabled: () => canCheck.value,
  },
  {
    id: "stop-check",
    label: t("check.action.stop"),
    short: t("common.stop"),
    group: "pictures",
    run: () => checking.value?.stop.abort(),
    enabled: () => checking.value !== null,
  },
];
