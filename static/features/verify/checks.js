// The checks of a saved version before it is activated: made once a version while raw and corrected are compared.
import { computed, effect, signal, untracked } from "@preact/signals";
import { Problem, ServerUnreachable, request } from "../../core/api.js";
import { Stopped, runJob } from "../../core/jobs.js";
import { cameras, comparing } from "../../core/state.js";
import { t } from "../../core/words.js";
import { version, versions } from "../versions/versions.js";
import {
  accuracyFinding,
  check,
  differenceFinding,
  fieldFinding,
  heightFinding,
  lensFinding,
  linesFinding,
  modelFinding,
  neighbourFinding,
  packetFinding,
} from "./findings.js";

/**
 * @typedef {import("./types").Check} Check
 * @typedef {import("./types").Change} Change
 * @typedef {import("../../core/types").Calibration} Calibration
 * @typedef {{ id: string, title: string, find: (stop: AbortSignal) => Promise<Check | null> }} Question null: it says
 * nothing of this version
 */

const BLOCKING = /^(lines|neighbour-)/; // what may turn out bad is waited for
const REFUSED_PAIR = new Set([409, 422]); // another field, nothing that both cameras cover

/** The active version of the camera, where it is another one. */
const former = computed(() => {
  const it = version.value,
    active = cameras.value.find((c) => c.id === it?.camera)?.active_calibration ?? null;
  return active === it?.id ? null : active;
});
/** What is to be checked: a version, beside the one that is active; "" while nobody looks. */
const wanted = computed(() => (comparing.value && version.value ? `${version.value.id} ${former.value ?? ""}` : ""));

/** of: what was checked. */
const found = signal(
  /** @type {{ of: string, items: Check[], change: Change | null }} */ ({ of: "", items: [], change: null }),
);
let stop = new AbortController();

/** In the order of the checklist; empty while nothing is checked. */
export const checks = computed(() => (found.value.of === wanted.value ? found.value.items : []));
/** How positions change against the active version. */
export const change = computed(() => (found.value.of === wanted.value ? found.value.change : null));
/** What is wrong with the version. */
export const problems = computed(() => checks.value.filter((c) => c.state === "bad"));
/** Whether the version can be activated as it is, only after a warning, or not yet. */
export const gate = computed(() => {
  if (!checks.value.length || checks.value.some((c) => c.state === "running" && BLOCKING.test(c.id)))
    return /** @type {const} */ ("wait");
  return problems.value.length ? /** @type {const} */ ("warn") : /** @type {const} */ ("ok");
});

effect(() => {
  const of = wanted.value;
  untracked(() => (of ? begin(of, /** @type {Calibration} */ (version.value)) : leave()));
});

/** @param {string} of @param {Calibration} it */
function begin(of, it) {
  if (of === found.value.of) return;
  stop.abort();
  stop = new AbortController();
  const questions = questionsOf(it),
    asked = questions.map(({ id, title }) => check({ id, title, state: "running" }));
  const [lines, packet, ...others] = asked;
  const accuracy = [accuracyFinding(it), packet]; // what the version has, and what teams receive of it
  const items = [lines, ...fieldFinding(it), ...accuracy, modelFinding(it), heightFinding(it), ...others];
  found.value = { of, items, change: null };
  for (const question of questions) void answer(question, stop.signal);
}

/** What is not known yet will be asked for again; the rest is kept for whoever comes back. */
function leave() {
  if (!found.value.items.some((c) => c.state === "running")) return;
  stop.abort();
  found.value = { of: "", items: [], change: null };
}

/** Put the answer into its place, unless another version is shown by then.
 * @param {Question} question @param {AbortSignal} signalled */
async function answer({ id, title, find }, signalled) {
  /** @type {Check | null} */
  let is = check({ id, title, state: "unknown" });
  try {
    is = await find(signalled);
  } catch (error) {
    if (signalled.aborted) return;
    is = check({ id, title, state: "unknown", ...reasonOf(error) });
    if (!isRefusal(error)) throw error;
  } finally {
    if (!signalled.aborted)
      found.value = { ...found.value, items: found.value.items.flatMap((c) => (c.id === id ? (is ?? []) : c)) };
  }
}

/** @param {unknown} error */
const isRefusal = (error) =>
  error instanceof Problem || error instanceof ServerUnreachable || error instanceof Stopped;

/** @param {unknown} error */
const reasonOf = (error) => ({
  text: error instanceof Stopped ? t("verify.cancelled") : /** @type {Error} */ (error).message,
  fix: error instanceof Problem ? error.fix : "",
});

/** What the server is asked. @param {Calibration} it @returns {Question[]} */
function questionsOf(it) {
  const other = former.value;
  return [
    { id: "lines", title: t("verify.lines"), find: (stopped) => findLines(it, stopped) },
    {
      id: "packet",
      title: t("verify.packet"),
      find: async (stopped) => packetFinding(await get(`/calibrations/${it.id}/packet`, stopped)),
    },
    ...(other ? changeQuestions(it, other) : []),
    ...neighboursOf(it).map(({ id, name, active_calibration }) => ({
      id: `neighbour-${id}`,
      title: t("verify.neighbour", { camera: name }),
      find: (/** @type {AbortSignal} */ stopped) =>
        findNeighbour(it, `neighbour-${id}`, name, active_calibration, stopped),
    })),
  ];
}

/** @param {Calibration} it @param {AbortSignal} stopped */
async function findLines(it, stopped) {
  if (!it.snapshot)
    return check({ id: "lines", title: t("verify.lines"), state: "unknown", text: t("verify.lines.no-image") });
  const asked = { snapshot: it.snapshot };
  return linesFinding(it, await runJob(`/calibrations/${it.id}/check?job=true`, asked, stopped, () => {}));
}

/**
 * The lens and the positions: one answer for both.
 * @param {Calibration} it
 * @param {string} other
 * @returns {Question[]}
 */
function changeQuestions(it, other) {
  /** @type {Promise<import("./types").Difference> | null} */
  let difference = null;
  const ask = (/** @type {AbortSignal} */ stopped) =>
    (difference ??= get(`/calibrations/${other}/difference/${it.id}.json`, stopped));
  const from = () => {
    const number = versions.value.find((v) => v.id === other)?.version;
    return number === undefined ? t("verify.former.active") : t("verify.former.version", { version: number });
  };
  return [
    { id: "lens", title: t("verify.lens"), find: async (stopped) => lensFinding(await ask(stopped), from()) },
    {
      id: "difference",
      title: t("verify.difference-from-active"),
      find: async (stopped) => {
        const is = await ask(stopped);
        const finding = differenceFinding(is, from());
        if (!stopped.aborted && finding.state === "note")
          found.value = { ...found.value, change: { from: from(), difference: is } };
        return finding;
      },
    },
  ];
}

/** Other cameras over the same field whose areas touch this one. @param {Calibration} it */
function neighboursOf(it) {
  const { regions } = it.field_definition,
    own = regions[it.region];
  return cameras.value.filter(({ id, field, region, active_calibration }) => {
    const there = region === null ? null : regions[region];
    return id !== it.camera && field === it.field && active_calibration && (!own || !there || touch(own, there));
  });
}

/** @param {import("../../core/types").Region} a @param {import("../../core/types").Region} b */
const touch = (a, b) =>
  Math.max(...a.x) >= Math.min(...b.x) &&
  Math.max(...b.x) >= Math.min(...a.x) &&
  Math.max(...a.y) >= Math.min(...b.y) &&
  Math.max(...b.y) >= Math.min(...a.y);

/** @param {Calibration} it @param {string} id @param {string} name @param {string | null} other @param {AbortSignal}
 * stopped */
async function findNeighbour(it, id, name, other, stopped) {
  const pair = { calibration_a: it.id, calibration_b: other };
  try {
    const response = await request("POST", "/pairs", { json: pair, stop: stopped });
    return neighbourFinding(id, name, (await response.json()).agreement);
  } catch (error) {
    if (error instanceof Problem && REFUSED_PAIR.has(error.status)) return null;
    throw error;
  }
}

/** @param {string} path @param {AbortSignal} stopped */
const get = async (path, stopped) => (await request("GET", path, { stop: stopped })).json();
