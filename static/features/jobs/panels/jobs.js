// Long work: running jobs, their progress, how to stop them, and their results.
import { call } from "../../../core/api.js";
import { dayAndTime, number, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf, go } from "../../../core/route.js";
import { notifyError } from "../../../core/state.js";
import { openBoard, showLens } from "../../board/board.js";
import { KINDS, cancelJob, isConnected, isOver, jobs, running } from "../job_list.js";

/** @typedef {import("../types").JobInList} JobInList */

const STATES = {
  queued: "Waiting",
  running: "At work",
  done: "Done",
  failed: "Failed",
  cancelled: "Cancelled",
};
const LEVEL = { queued: "", running: "", done: "good", failed: "poor", cancelled: "" };

export function JobsPage() {
  const all = jobs.value,
    ended = all?.filter(isOver) ?? [];
  return html`<div class="page" data-testid="jobs-page">
    <h1>Jobs</h1>
    <p class="dim">
      What takes longer than a moment is done by the server in the background. It goes on when this page is
      closed, and over a restart of the server.
    </p>
    ${all && !isConnected.value && html`<p class="warning-line" role="status">
      The server does not answer: this is what was known last. What is at work goes on by itself when the
      server is back.
    </p>`}
    ${all === null
      ? html`<p class="dim">Asking the server…</p>`
      : html`
        <section aria-label="At work">
          <h2>At work or waiting</h2>
          ${running.value.length
            ? html`<ul class="jobs" data-testid="running-jobs">
              ${running.value.map((job) => html`<${Row} key=${job.id} job=${job} />`)}
            </ul>`
            : html`<p class="dim">
              Nothing. Comparing models, finding a lens and judging edges show here while they last.
            </p>`}
        </section>
        <section aria-label="Ended">
          <h2>Ended</h2>
          ${ended.length
            ? html`<ul class="jobs" data-testid="ended-jobs">
              ${ended.map((job) => html`<${Row} key=${job.id} job=${job} />`)}
            </ul>`
            : html`<p class="dim">Nothing yet.</p>`}
        </section>
      `}
  </div>`;
}

/** @param {{ job: JobInList }} props */
function Row({ job }) {
  const { id, kind, state, progress, message, problem, attempt } = job,
    what = KINDS[kind] ?? kind;
  return html`<li class="card" data-testid="job" data-id=${id} data-state=${state}>
    <div class="line">
      <b>${what}</b>
      <span class=${`level ${LEVEL[state]}`}>${STATES[state]}</span>
      <small class="grow">${when(job)}</small>
      ${!isOver(job) && html`<button
        type="button"
        data-testid="cancel-job"
        aria-label=${`Cancel: ${what}`}
        onClick=${() => void cancelJob(id)}
      >
        Cancel
      </button>`}
      <${Made} job=${job} />
    </div>
    ${!isOver(job) && html`
      <progress max="1" value=${progress} aria-label=${what}></progress>
      <small data-testid="job-message">
        ${number(100 * progress, 0)} %${message ? `, ${message}` : ""}
      </small>
    `}
    ${attempt > 1 && html`<small data-testid="job-attempt">
      Attempt ${attempt}: its worker was lost, or the server was stopped in the middle of it, so it was begun
      anew.
    </small>`}
    ${problem && html`<p class="warning-line">
      <b>${problem.detail}</b> ${problem.fix}
    </p>`}
  </li>`;
}

/** @param {JobInList} job */
function when({ created_at, ended_at }) {
  if (!ended_at) return `since ${dayAndTime(created_at)}`;
  const seconds = (Date.parse(ended_at) - Date.parse(created_at)) / 1000;
  return `${dayAndTime(created_at)}, ` +
    `${seconds < 90 ? `${number(seconds, seconds < 10 ? 1 : 0)} s` : `${number(seconds / 60, 0)} min`}`;
}

/** The way to what came of it. @param {{ job: JobInList }} props */
function Made({ job: { state, kind, made } }) {
  if (state !== "done") return null;
  if (made.calibration)
    return html`<button
      type="button"
      data-testid="show-made"
      onClick=${() => void showVersion(/** @type {string} */ (made.calibration))}
    >
      Show the version
    </button>`;
  if (made.lens && kind === "motion")
    return html`<small>the lens is kept; hold it under Model, Lens, in the next fit</small>`;
  if (made.lens)
    return html`<button
      type="button"
      data-testid="show-made"
      onClick=${() => void toLens(/** @type {string} */ (made.lens))}
    >
      Show the lens
    </button>`;
  if (kind === "straightness")
    return html`<a data-testid="show-made" href=${addressOf("edges")}>
      Show the edges
    </a>`;
  return kind === "comparison"
    ? html`<small>shown beside the clicks it was asked for; nothing is kept</small>`
    : null;
}

/** Where a version can be looked at: on its picture, or among its camera's. @param {string} id */
async function showVersion(id) {
  try {
    const { snapshot, camera } = await call("GET", `/calibrations/${id}`);
    if (snapshot) go("calibrate", { picture: snapshot, step: "verify" });
    else go("versions", { camera: camera ?? "" });
  } catch (error) {
    notifyError(error);
  }
}

/** @param {string} id */
async function toLens(id) {
  await openBoard();
  await showLens(id).catch(notifyError);
}

/** In the status bar while something runs. */
export function JobsIndicator() {
  const now = running.value;
  if (!now.length) return null;
  const share = now.reduce((sum, job) => sum + job.progress, 0) / now.length;
  return html`<a
    class="at-work"
    href=${addressOf("jobs")}
    data-testid="at-work"
    title=${now.map((job) => `${KINDS[job.kind] ?? job.kind}: ${number(100 * job.progress, 0)} %`).join("\n")}
    aria-label=${`${plural(now.length, "job")} at work`}
  >
    <progress max="1" value=${share} aria-hidden="true"></progress>
    ${now.length}
  </a>`;
}
