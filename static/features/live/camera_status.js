// Status of live cameras, polled while shown, and the addresses of their streams.
import { signal } from "@preact/signals";
import { address, call } from "../../core/api.js";

/** @typedef {import("../../core/types").CameraStatus} CameraStatus */

const EVERY_MS = 1000;

/** By camera. */
export const statuses = signal(/** @type {Record<string, CameraStatus>} */ ({}));
/** Whose status is wanted now, by what shows it. @type {Map<object, string[]>} */
const wanted = new Map();
let timer = 0,
  asking = false;

/**
 * Keep those cameras' statuses fresh until the returned function is called.
 * @param {string[]} ids
 * @returns {() => void}
 */
export function followCameras(ids) {
  const key = {};
  wanted.set(key, ids);
  void refreshStatuses();
  return () => {
    wanted.delete(key);
  };
}

/** Ask at once, and again as long as somebody looks. */
export async function refreshStatuses() {
  clearTimeout(timer);
  if (asking) return;
  asking = true;
  const ids = [...new Set([...wanted.values()].flat())];
  if (!document.hidden) {
    const answers = await Promise.all(ids.map((id) => call("GET", `/cameras/${id}/status`).catch(() => null)));
    statuses.value = Object.fromEntries(ids.map((id, i) => [id, answers[i] ?? lost(statuses.value[id])]));
  }
  asking = false;
  if (wanted.size) timer = setTimeout(() => void refreshStatuses(), EVERY_MS);
}

/** @param {CameraStatus | undefined} before @returns {CameraStatus} */
const lost = (before) =>
  /** @type {any} */ ({
    ...before,
    state: "offline",
    words: [],
    problem: {
      reason: "server-gone",
      what: "The server does not answer.",
      fix: "Check that it runs; the page tries again by itself.",
    },
  });

/**
 * A stream's address. fps: at most; 0 all.
 * @param {string} id
 * @param {string} view
 * @param {number} width
 * @param {number} fps
 */
export function streamAddress(id, view, width, fps = 0) {
  const to = new URL(
    address(
      `/cameras/${encodeURIComponent(id)}/stream?view=${view}&width=${width}&ack=true${fps ? `&fps=${fps}` : ""}`,
    ),
    location.href,
  );
  to.protocol = to.protocol.replace("http", "ws");
  return to.href;
}

/** What a state is called. */
export const STATES = {
  connecting: "Connecting",
  live: "Live",
  stalled: "Stalled",
  offline: "Offline",
  mismatch: "Check camera",
};
