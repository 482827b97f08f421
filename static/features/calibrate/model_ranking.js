// Compares every model on the same clicks while the operator chooses one.
import { effect, signal, untracked } from "@preact/signals";
import { ServerUnreachable, call, online, toRefusal } from "../../core/api.js";
import {
  FACTS,
  change,
  doc,
  dragging,
  withAutomaticModel,
  withModel,
} from "../../core/document.js";
import { Stopped, followJob, runJob } from "../../core/jobs.js";
import { lensOpen } from "../../core/folds.js";
import { comparing, editing, model, models, snapshot } from "../../core/state.js";
import { gate } from "../verify/checks.js";
import { isSaved, isUncompared } from "../versions/versions.js";
import { fitBody, preview, stale } from "./fitting.js";

const PAUSE_MS = 400; // seven fits and their cross-validation are not asked for at pointer rate

/** The models, best first, for the clicks in `of`. */
export const ranking = signal(
  /** @type {(import("../../core/types").Ranking & { of: string }) | null} */ (null),
);
/** The comparison under way. */
export const comparison = signal(
  /** @type {{ of: string, progress: number, message: string, stop: AbortController } | null} */ (
    null
  ),
);
/**
 * The clicks that are not compared: refused by the server, or stopped by the operator, for whom there is nothing to
 * say.
 */
export const notCompared = signal(
  /** @type {{ of: string, why: import("../../core/types").Refusal | null } | null} */ (null),
);

/** What a ranking depends on: the clicks and the field, not the model that is chosen. */
function clicks() {
  const { model: _model, options, ...others } = fitBody(doc.value);
  return {
    ...others,
    options: Object.fromEntries(
      FACTS.flatMap((name) => (name in options ? [[name, options[name]]] : [])),
    ),
  };
}

/** Whether the ranking is of the present clicks. */
export const isFresh = () => ranking.value?.of === JSON.stringify(clicks());

/** @param {ReturnType<typeof clicks>} body */
async function compare(body) {
  const of = JSON.stringify(body),
    stop = new AbortController();
  stopNow();
  comparison.value = { of, progress: 0, message: "", stop };
  notCompared.value = null;
  try {
    const onProgress = (
      /** @type {import("../../core/types").Job} */ { id, progress, message },
    ) => {
      ownJob.keep(of, id);
      if (comparison.value?.stop === stop) comparison.value = { of, progress, message, stop };
    };
    const before = await ownJob.of(of);
    const found = await (before
      ? followJob(before, stop.signal, onProgress)
      : runJob("/calibrations/compare?job=true", body, stop.signal, onProgress));
    if (!stop.signal.aborted) ranking.value = { ...found, of };
  } catch (error) {
    // When the server is away, the models are compared once it is back.
    if (!stop.signal.aborted && !(error instanceof ServerUnreachable))
      notCompared.value = { of, why: error instanceof Stopped ? null : toRefusal(error) };
    if (!stop.signal.aborted && !(error instanceof ServerUnreachable)) ownJob.forget();
  } finally {
    if (comparison.value?.stop === stop) comparison.value = null;
  }
}

/** The comparison that this tab asked for: a reload in the middle of it goes on watching it. */
const ownJob = {
  key: "touchline.comparison",
  /** @param {string} of @param {string} job */
  keep(of, job) {
    try {
      sessionStorage.setItem(this.key, JSON.stringify({ of, job }));
    } catch {
      /* then a reload asks anew */
    }
  },
  forget() {
    sessionStorage.removeItem(this.key);
  },
  /**
   * @param {string} of
   * @returns {Promise<import("../../core/types").Job | null>} the job on just these clicks, unless it was lost or
   * stopped
   */
  async of(of) {
    const kept = JSON.parse(sessionStorage.getItem(this.key) ?? "null");
    if (kept?.of !== of) return null;
    const job = await call("GET", `/jobs/${kept.job}`).catch(() => null);
    return job && job.state !== "cancelled" && job.state !== "failed" ? job : null;
  },
};

/** Compare now, though it was stopped. */
export function compareModels() {
  void compare(clicks());
}

/** Stop what is under way: whoever begins again at once must not watch it end. */
function stopNow() {
  if (!comparison.value) return;
  comparison.value.stop.abort();
  comparison.value = null;
  ownJob.forget();
}

/** Stop comparing these clicks. */
export function stopComparing() {
  const of = comparison.value?.of;
  stopNow();
  if (of) notCompared.value = { of, why: null };
}

/** @param {string} name */
export function useModel(name) {
  const next = models.value.find((m) => m.name === name);
  if (next && next.name !== doc.value.model) change(withModel(doc.value, next, model.value));
}

/** Leave the choice to the server. */
export const useAutomaticModel = () => change(withAutomaticModel(doc.value));

/** While the models are unfolded; and for a version that was saved before they were compared, once it is checked. */
const isShown = () =>
  editing.value
    ? lensOpen.value
    : comparing.value && isSaved.value && isUncompared.value && gate.value !== "wait";

/** Keep the ranking up to date while it is wanted, from now on. */
export function startRanking() {
  let timer = 0;
  effect(() => {
    const isWanted =
      isShown() && preview.value !== null && !stale.value && !dragging.value && online.value;
    void doc.value;
    clearTimeout(timer);
    untracked(() => {
      const body = clicks(),
        of = JSON.stringify(body);
      const isKnown = [ranking, comparison, notCompared].some((asked) => asked.value?.of === of);
      if (!isShown() || comparison.value?.of !== of) stopNow();
      if (isWanted && !isKnown) timer = setTimeout(() => void compare(body), PAUSE_MS);
    });
  });
  effect(() => {
    // another picture has nothing to do with this ranking
    void snapshot.value?.id;
    untracked(() => {
      ranking.value = null;
      notCompared.value = null;
    });
  });
}
