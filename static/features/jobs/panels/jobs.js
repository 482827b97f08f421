// Long work: running jobs, their progress, how to stop them, and their results.
import { call } from "../../../core/api.js";
import { KINDS } from "../../../core/features.js";
import { dayAndTime, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf, go } from "../../../core/route.js";
import { notifyError } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { openBoard, showLens } from "../../boards/board.js";
import { cancelJob, isConnected, isOver, jobs, running } from "../job_list.js";

/** @typedef {import("../types").JobInList} JobInList */

const STATES = {
  queued: t("jobs.state.queued"),
  running: t("jobs.state.running"),
  done: t("jobs.state.done"),
  failed: t("jobs.state.failed"),
  cancelled: t("jobs.state.cancelled"),
};
const LEVEL = { queued: "", running: "", done: "good", failed: "poor", cancelled: "" };

export function JobsPage() {
  const all = jobs.value,
    ended = all?.filter(isOver) ?? [];
  return html`<div class="page" data-testid="jobs-page">
    <h1>${t("jobs.title")}</h1>
    <p class="dim">${t("jobs.about")}</p>
    ${
      all &&
      !isConnected.value &&
      html`<p class="warning-line" role="status">
      ${t("jobs.away")}
    </p>`
    }
    ${
      all === null
        ? html`<p class="dim">${t("common.asking")}</p>`
        : html`
        <section aria-label=${t("jobs.running.label")}>
          <h2>${t("jobs.running.title")}</h2>
          ${
            running.value.length
              ? html`<ul class="jobs" data-testid="running-jobs">
              ${running.value.map((job) => html`<${Row} key=${job.id} job=${job} />`)}
            </ul>`
              : html`<p class="dim">
              ${t("jobs.running.none")}
            </p>`
          }
        </section>
        <section aria-label=${t("jobs.ended.title")}>
          <h2>${t("jobs.ended.title")}</h2>
          ${
            ended.length
              ? html`<ul class="jobs" data-testid="ended-jobs">
              ${ended.map((job) => html`<${Row} key=${job.id} job=${job} />`)}
            </ul>`
              : html`<p class="dim">${t("jobs.ended.none")}</p>`
          }
        </section>
      `
    }
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
      ${
        !isOver(job) &&
        html`<button
        type="button"
        data-testid="cancel-job"
        aria-label=${t("jobs.cancel.label", { job: what })}
        onClick=${() => void cancelJob(id)}
      >
        ${t("common.cancel")}
      </button>`
      }
      <${Made} job=${job} />
    </div>
    ${
      !isOver(job) &&
      html`
      <progress max="1" value=${progress} aria-label=${what}></progress>
      <small data-testid="job-message">
        ${number(100 * progress, 0)} %${message ? `, ${message}` : ""}
      </small>
    `
    }
    ${
      attempt > 1 &&
      html`<small data-testid="job-attempt">
      ${t("jobs.attempt", { attempt })}
    </small>`
    }
    ${
      problem &&
      html`<p class="warning-line">
      <b>${problem.detail}</b> ${problem.fix}
    </p>`
    }
  </li>`;
}

/** @param {JobInList} job */
function when({ created_at, ended_at }) {
  if (!ended_at) return t("jobs.since", { time: dayAndTime(created_at) });
  const seconds = (Date.parse(ended_at) - Date.parse(created_at)) / 1000;
  return (
    `${dayAndTime(created_at)}, ` +
    `${seconds < 90 ? `${number(seconds, seconds < 10 ? 1 : 0)} s` : `${number(seconds / 60, 0)} min`}`
  );
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
      ${t("jobs.made.version")}
    </button>`;
  if (made.lens && kind === "motion") return html`<small>${t("jobs.made.lens-kept")}</small>`;
  if (made.lens)
    return html`<button
      type="button"
      data-testid="show-made"
      onClick=${() => void toLens(/** @type {string} */ (made.lens))}
    >
      ${t("jobs.made.lens")}
    </button>`;
  if (kind === "straightness")
    return html`<a data-testid="show-made" href=${addressOf("edges")}>
      ${t("jobs.made.edges")}
    </a>`;
  return kind === "comparison" ? html`<small>${t("jobs.made.comparison")}</small>` : null;
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
    aria-label=${t("jobs.at-work", { count: now.length })}
  >
    <progress max="1" value=${share} aria-hidden="true"></progress>
    ${now.length}
  </a>`;
}
