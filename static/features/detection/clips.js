// Clips of a camera: recorded, stepped through frame by frame, played again and again while colours and stages are tuned.
import { computed, effect, signal } from "@preact/signals";
import { call, request } from "../../core/api.js";
import { tell, tellError } from "../../core/state.js";
import { shown } from "./detection.js";
import { hold, holdOf, isSeen, letGo, still } from "./held_frame.js";

/** @typedef {import("./types").Clip} Clip */

const SECONDS = 5, TICK_MS = 200;

const all = signal(/** @type {Clip[]} */ ([]));
/** Those of the camera that is shown, newest first. */
export const clips = computed(() => all.value.filter((c) => c.camera === shown.value?.id));
/** How far a recording is, and the way to stop it. */
export const recording = signal(/** @type {{ share: number, stop: AbortController } | null} */ (null));
export const playing = signal(false);

/** Keep the last seconds of the camera, and stand at the first frame. */
export async function record() {
  const camera = shown.value?.id;
  if (!camera || recording.value) return;
  const stop = new AbortController(), begun = Date.now();
  const tick = setInterval(() => { recording.value = { share: Math.min(1, (Date.now() - begun) / 1000 / SECONDS), stop }; }, TICK_MS);
  recording.value = { share: 0, stop };
  try {
    const clip = await (await request("POST", `/cameras/${encodeURIComponent(camera)}/clip`, { json: { seconds: SECONDS }, stop: stop.signal })).json();
    await readClips();
    if (shown.value?.id === camera) openClip(clip.clip);
  } catch (error) {
    if (!stop.signal.aborted) tellError(error);
  } finally {
    clearInterval(tick);
    recording.value = null;
  }
}

/** @param {string} id of a clip; "" goes back to the camera */
export function openClip(id) {
  const clip = clips.value.find((c) => c.clip === id);
  playing.value = false;
  if (clip) holdOf(clip, 0);
  else letGo();
}

/** @param {number} number counted from 0 */
export function seek(number) {
  const clip = still.value?.clip;
  if (clip) holdOf(clip, number);
}

/** Of a clip, or of the camera. */
export function nextFrame() {
  const it = still.value;
  if (!it?.clip) { void hold(); return; }
  playing.value = false;
  seek(it.number + 1);
}

export function previousFrame() {
  playing.value = false;
  seek((still.value?.number ?? 0) - 1);
}

export const play = () => { playing.value = !playing.value; };

/** @param {Clip} clip */
export async function removeClip(clip) {
  try {
    await call("DELETE", `/clips/${clip.clip}`);
    if (still.value?.clip?.clip === clip.clip) letGo();
    await readClips();
    tell({ level: "info", text: "The clip was removed.", fix: "" });
  } catch (error) {
    tellError(error);
  }
}

async function readClips() {
  try {
    all.value = (await call("GET", "/clips")).items;
  } catch (error) {
    tellError(error);
  }
}

/** Know the clips as long as the page is there; while one plays, show the next frame once this one is seen. */
export function startClips() {
  const id = computed(() => shown.value?.id);
  effect(() => { if (id.value) void readClips(); playing.value = false; });
  effect(() => {
    const it = still.value;
    if (!it?.clip || !playing.value || !isSeen.value) return undefined;
    const { clip, number } = it, timer = setTimeout(() => holdOf(clip, (number + 1) % clip.frames), 1000 / (clip.fps || 10));
    return () => clearTimeout(timer);
  });
}
