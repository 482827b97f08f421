// All long work on the server, over one socket that reconnects.
import { computed, signal } from "@preact/signals";
import { call } from "../../core/api.js";
import { openSocket } from "../../core/socket.js";
import { notifyError } from "../../core/state.js";
import { t } from "../../core/words.js";

/** @typedef {import("./types").JobInList} JobInList */

/** Newest first; null before the first message. */
export const jobs = signal(/** @type {JobInList[] | null} */ (null));
/** Whether the list is of now: the line stands. */
export const isConnected = signal(false);

/** @param {JobInList} job */
export const isOver = (job) => job.state === "done" || job.state === "failed" || job.state === "cancelled";
export const running = computed(() => (jobs.value ?? []).filter((job) => !isOver(job)));

/** What a kind of work is called. @type {Record<string, string>} */
export const KINDS = {
  calibration: t("jobs.kind.calibration"),
  preview: t("jobs.kind.preview"),
  comparison: t("jobs.kind.comparison"),
  board: t("jobs.kind.board"),
  straightness: t("jobs.kind.straightness"),
  motion: t("jobs.kind.motion"),
  pair: t("jobs.kind.pair"),
  auto: t("jobs.kind.auto"),
  register: t("jobs.kind.register"),
  check: t("jobs.kind.check"),
  "field-refit": t("jobs.kind.field-refit"),
  "rig-check": t("jobs.kind.rig-check"),
  "rig-refit": t("jobs.kind.rig-refit"),
};

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
