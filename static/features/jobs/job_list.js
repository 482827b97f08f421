// All long work on the server, over one socket that reconnects.
import { computed, signal } from "@preact/signals";
import { call } from "../../core/api.js";
import { openSocket } from "../../core/socket.js";
import { notifyError } from "../../core/state.js";

/** @typedef {import("./types").JobInList} JobInList */

/** Newest first; null before the first message. */
export const jobs = signal(/** @type {JobInList[] | null} */ (null));
/** Whether the list is of now: the line stands. */
export const isConnected = signal(false);

/** @param {JobInList} job */
export const isOver = (job) =>
  job.state === "done" || job.state === "failed" || job.state === "cancelled";
export const running = computed(() => (jobs.value ?? []).filter((job) => !isOver(job)));

/** Hear of all jobs from now on. */
export function startJobs() {
  openSocket("/jobs/stream", {
    onMessage: (now) => {
      if (!("items" in now)) return;
      jobs.value = now.items;
      isConnected.value = true;
    },
    onBreak: () => {
      isConnected.value = false;
    },
  });
}

/** @param {string} id */
export async function cancelJob(id) {
  try {
    await call("DELETE", `/jobs/${id}`);
  } catch (error) {
    notifyError(error);
  }
}
