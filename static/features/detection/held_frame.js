// A held frame: colours and stages are tuned on it, and detection runs on it again after each change.
import { computed, effect, signal } from "@preact/signals";
import { address, call, request, toRefusal } from "../../core/api.js";
import { fields, notifyError } from "../../core/state.js";
import {
  detectionCamera,
  detectionState,
  isListening,
  latestFrame,
  whenSaved,
} from "./detection.js";

/**
 * @typedef {import("./types").DetectionFrame} DetectionFrame
 * @typedef {import("./types").HeldFrame} HeldFrame
 * @typedef {import("./types").Clip} Clip
 */

const FILLED = 0.9,
  SOME_FIELD_MM = 5000; // of the picture by the field, about, where no calibration tells sizes
const KEY = "touchline.held"; // a reload of this tab shows the same frame

/** @type {HeldFrame | null} */
let before = null;
try {
  before = JSON.parse(sessionStorage.getItem(KEY) ?? "null");
} catch {
  /* what is kept there is none */
}
const held = signal(before);
/** Whether a frame is being taken. */
export const taking = signal(false);
/** The frame that is held before the camera that is shown. */
export const heldFrame = computed(() =>
  held.value && held.value.camera === detectionCamera.value?.id ? held.value : null,
);
/** What was found in it; null until then. */
const found = signal(/** @type {DetectionFrame | null} */ (null));
/** Why nothing was. */
export const heldFrameRefusal = signal(
  /** @type {import("../../core/types").Refusal | null} */ (null),
);
/** Which frame that is. */
const answered = signal("");
/** Whether the held frame has been seen, be it in vain. */
export const isDetected = computed(
  () => heldFrame.value !== null && answered.value === frameOf(heldFrame.value),
);
/** What is seen now: in the held frame, or in the newest. */
export const detections = computed(() => (heldFrame.value ? found.value : latestFrame.value));

/** Take the frame of now and hold it; when one is held already, the next one. */
export async function holdFrame() {
  const camera = detectionCamera.value?.id;
  if (!camera || taking.value) return;
  taking.value = true;
  try {
    const { id, width, height } = await call("POST", "/snapshots", { camera, purpose: "seeing" });
    found.value = null;
    keep({ camera, id, width, height, clip: null, number: 0 });
  } catch (error) {
    notifyError(error);
  } finally {
    taking.value = false;
  }
}

export const releaseFrame = () => keep(null);

/** One frame of a clip. @param {Clip} clip @param {number} number counted from 0 */
export const holdClipFrame = (clip, number) =>
  keep({
    camera: clip.camera,
    id: "",
    width: clip.width,
    height: clip.height,
    clip,
    number: Math.min(Math.max(number, 0), clip.frames - 1),
  });

/** @param {HeldFrame} it */
const frameOf = (it) =>
  it.clip ? `/clips/${it.clip.clip}/frames/${it.number}` : `/snapshots/${it.id}`;

/** The held frame as it was taken. @param {HeldFrame} it */
export const framePicture = (it) =>
  address(it.clip ? `${frameOf(it)}.jpg` : `${frameOf(it)}/image.jpg`);

/**
 * The held frame as a snapshot, which colours are taught from; null: none is held.
 * @returns {Promise<string | null>}
 */
export async function asSnapshot() {
  const it = heldFrame.value;
  if (!it || it.id) return it?.id ?? null;
  const body = new FormData();
  body.append("file", await (await request("GET", `${frameOf(it)}.jpg`)).blob(), "frame.jpg");
  body.append("camera", it.camera);
  body.append("purpose", "seeing");
  const { id } = await (await request("POST", "/snapshots", { body })).json();
  if (heldFrame.value === it) held.value = { ...it, id };
  return id;
}

/** @param {HeldFrame | null} next */
function keep(next) {
  held.value = next;
  try {
    sessionStorage.setItem(KEY, JSON.stringify(next));
  } catch {
    /* a reload then shows the camera live */
  }
}

/** How large a pixel is, about, from the field that the camera is said to show. @param {HeldFrame} it */
function guessed(it) {
  const of = detectionCamera.value,
    field = fields.value.find((f) => f.name === of?.field),
    part = of?.region ? field?.regions[of.region] : undefined;
  const across = part
    ? Math.hypot(part.width_mm, part.height_mm)
    : field
      ? Math.hypot(field.length_mm, field.width_mm)
      : 0;
  return (across / FILLED || SOME_FIELD_MM) / Math.hypot(it.width, it.height);
}

/**
 * What the server is asked about the held frame, null while that is not known: a clip's is seen by what the camera
 * keeps, a snapshot with all that is told.
 * @type {import("@preact/signals").ReadonlySignal<any>}
 */
export const detectionRequest = computed(() => {
  const it = heldFrame.value,
    now = detectionState.value,
    calibration = detectionCamera.value?.active_calibration ?? null;
  if (!it || !now) return null;
  if (it.clip)
    return {
      frame: frameOf(it),
      by: [now.plan, now.profile, detectionCamera.value?.active_calibration],
    };
  const { name, title, stages, corrected = false } = now.plan;
  return {
    snapshot: it.id,
    stages: { name, title, stages, ...(corrected && calibration ? { corrected } : {}) },
    colours: now.profile,
    calibration,
    ...(calibration ? {} : { mm_per_px: guessed(it) }),
  };
});

/**
 * The picture that a stage made of the held frame; its address is to be revoked.
 * @param {any} body as asked
 * @param {string} stage
 * @param {AbortSignal} stop
 */
export async function stagePicture(body, stage, stop) {
  if (body.frame) await whenSaved();
  const response = await (body.frame
    ? request("GET", `${body.frame}.jpg?stage=${stage}`, { stop })
    : request("POST", `/detections/picture.jpg?stage=${stage}`, { json: body, stop }));
  return URL.createObjectURL(await response.blob());
}

/** See the held frame, now and whenever something is changed. */
export function startHeldFrame() {
  const wish = computed(() => JSON.stringify(detectionRequest.value));
  effect(() => {
    isListening.value = !heldFrame.value;
  });
  effect(() => {
    const body = JSON.parse(wish.value);
    if (!body) return undefined;
    const stop = new AbortController();
    void look(body, stop.signal);
    return () => stop.abort();
  });
}

/** @param {any} body as asked @param {AbortSignal} stop */
async function look(body, stop) {
  try {
    if (body.frame) {
      await whenSaved();
      found.value = await (await request("GET", body.frame, { stop })).json();
      heldFrameRefusal.value = null;
      return;
    }
    const it = await (await request("POST", "/detections", { json: body, stop })).json();
    const stages = Object.entries(it.took_ms).map(([name, ms]) => ({ name, ms: Number(ms) }));
    found.value = {
      seq: 0,
      width: it.image_size[0],
      height: it.image_size[1],
      calibration: body.calibration,
      items: it.detections,
      stages,
      ms: stages.reduce((sum, s) => sum + s.ms, 0),
      notes: it.notes,
      fps: 0,
    };
    heldFrameRefusal.value = null;
  } catch (error) {
    if (stop.aborted) return;
    found.value = null;
    heldFrameRefusal.value = toRefusal(error);
  } finally {
    if (!stop.aborted) answered.value = body.frame ?? `/snapshots/${body.snapshot}`;
  }
}
