// Clips of a camera: recorded, stepped frame by frame, and played repeatedly while colours and stages are tuned.
import { computed, effect, signal } from "@preact/signals";
import { call, changeSeen, request } from "../../core/api.js";
import { notify, notifyError } from "../../core/state.js";
import { t } from "../../core/words.js";
import { detectionCamera } from "./detection.js";
import { heldFrame, holdClipFrame, holdFrame, isDetected, releaseFrame } from "./held_frame.js";

/** @typedef {import("./types").Clip} Clip */

const SECONDS = 5,
  TICK_MS = 200;

const all = signal(/** @type {Clip[]} */ ([]));
/** Those of the camera that is shown, newest first. */
export const clips = computed(() =>
  all.value.filter((c) => c.camera === detectionCamera.value?.id),
);
/** How far a recording is, and the way to stop it. */
export const recording = signal(
  /** @type {{ share: number, stop: AbortController } | null} */ (null),
);
export const playing = signal(false);

/** Keep the last seconds of the camera, and stand at the first frame. */
export async function recordClip() {
  const camera = detectionCamera.value?.id;
  if (!camera || recording.value) return;
  const stop = new AbortController(),
    begun = Date.now();
  const tick = setInterval(() => {
    recording.value = { share: Math.min(1, (Date.now() - begun) / 1000 / SECONDS), stop };
  }, TICK_MS);
  recording.value = { share: 0, stop };
  try {
    const clip = await (
      await request("POST", `/cameras/${encodeURIComponent(camera)}/clip`, {
        json: { seconds: SECONDS },
        stop: stop.signal,
      })
    ).json();
    await readClips();
    if (detectionCamera.value?.id === camera) openClip(clip.clip);
  } catch (error) {
    if (!stop.signal.aborted) notifyError(error);
  } finally {
    clearInterval(tick);
    recording.value = null;
  }
}

/** @param {string} id of a clip; "" goes back to the camera */
export function openClip(id) {
  const clip = clips.value.find((c) => c.clip === id);
  playing.value = false;
  if (clip) holdClipFrame(clip, 0);
  else releaseFrame();
}

/** @param {number} number counted from 0 */
export function seek(number) {
  const clip = heldFrame.value?.clip;
  if (clip) holdClipFrame(clip, number);
}

/** Of a clip, or of the camera. */
export function nextFrame() {
  const it = heldFrame.value;
  if (!it?.clip) {
    void holdFrame();
    return;
  }
  playing.value = false;
  seek(it.number + 1);
}

export function previousFrame() {
  playing.value = false;
  seek((heldFrame.value?.number ?? 0) - 1);
}

export const play = () => {
  playing.value = !playing.value;
};

/** @param {Clip} clip */
export async function removeClip(clip) {
  try {
    await changeSeen("DELETE", `/clips/${clip.clip}`, (now) => now.taken_at === clip.taken_at);
    if (heldFrame.value?.clip?.clip === clip.clip) releaseFrame();
    await readClips();
    notify({ level: "info", text: t("detection.clips.removed"), fix: "", about: "clip" });
  } catch (error) {
    notifyError(error);
  }
}

async function readClips() {
  try {
    all.value = (await call("GET", "/clips")).items;
  } catch (error) {
    notifyError(error);
  }
}

/** Know the clips as long as the page is there; while one plays, show the next frame once this one is seen. */
export function startClips() {
  const id = computed(() => detectionCamera.value?.id);
  effect(() => {
    if (id.value) void readClips();
    playing.value = false;
  });
  effect(() => {
    const it = heldFrame.value;
    if (!it?.clip || !playing.value || !isDetected.value) return undefined;
    const { clip, number } = it,
      timer = setTimeout(
        () => holdClipFrame(clip, (number + 1) % clip.frames),
        1000 / (clip.fps || 10),
      );
    return () => clearTimeout(timer);
  });
}
