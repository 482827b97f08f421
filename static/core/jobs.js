// One job on the server: start it, follow its progress to the end, cancel it.
import { Problem, ServerUnreachable, address, call, request } from "./api.js";
import { translated } from "./statements.js";

const RETRY_MS = 500;

/** @typedef {import("./types").Job} Job */

/** The work was stopped, here or elsewhere. */
export class Stopped extends Error {}

/** Ask for work that takes a while, and wait for its result. Refusals are thrown as they would be at once.
 * @param {string} path @param {unknown} json @param {AbortSignal} stop ends the work on the server too @param {(job:
 * Job) => void} onProgress how far it is */
export async function runJob(path, json, stop, onProgress) {
  const response = await request("POST", path, { json });
  return response.status === 202
    ? followJob(await response.json(), stop, onProgress)
    : response.json();
}

/**
 * Watch a job to its end; while the server is away, wait for it.
 * @param {Job} job
 * @param {AbortSignal} stop
 * @param {(job: Job) => void} onProgress
 * @returns {Promise<any>} its result
 */
export async function followJob(job, stop, onProgress) {
  // it may have ended already
  const cancel = () =>
    void request("DELETE", `/jobs/${job.id}`, { keepalive: true }).catch(() => {});
  if (stop.aborted) cancel();
  stop.addEventListener("abort", cancel);
  try {
    for (let now = job; ; now = await pollJob(now)) {
      if (stop.aborted || now.state === "cancelled") throw new Stopped();
      onProgress(now);
      if (!isOver(now)) now = await streamStates(now, stop, onProgress);
      if (stop.aborted || now.state === "cancelled") throw new Stopped();
      if (now.state === "done") return now.result;
      if (now.state === "failed") throw new Problem(now.problem?.status ?? 500, now.problem ?? {});
      await new Promise((resolve) => {
        setTimeout(resolve, RETRY_MS);
      }); // the line broke
    }
  } finally {
    stop.removeEventListener("abort", cancel);
  }
}

/** @param {Job} job */
const isOver = (job) => job.state === "done" || job.state === "failed" || job.state === "cancelled";

/** Every state of a job as the server tells it, until its end, a stop, or until the line breaks.
 * @param {Job} job @param {AbortSignal} stop @param {(job: Job) => void} onProgress @returns {Promise<Job>} the last
 * that was heard */
function streamStates(job, stop, onProgress) {
  return new Promise((resolve) => {
    let last = job;
    const line = new WebSocket(address(`/jobs/${job.id}/stream`));
    const end = () => line.close();
    line.addEventListener("message", ({ data }) => {
      const now = translated(JSON.parse(data));
      if (!("state" in now)) return; // a refusal: the next look says it
      last = now;
      if (isOver(now)) end();
      else if (!stop.aborted) onProgress(now);
    });
    line.addEventListener("close", () => {
      stop.removeEventListener("abort", end);
      resolve(last);
    });
    stop.addEventListener("abort", end);
  });
}

/** @param {Job} before @returns {Promise<Job>} as it is now; as it was, while the server does not answer */
async function pollJob(before) {
  try {
    return await call("GET", `/jobs/${before.id}`);
  } catch (error) {
    if (error instanceof ServerUnreachable) return before;
    throw error;
  }
}
