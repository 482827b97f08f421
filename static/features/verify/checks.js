// The checks of a saved version before it is activated: the server's claims, asked for while it is compared.
import { computed, effect, signal, untracked } from "@preact/signals";
import { Problem, ServerUnreachable, request } from "../../core/api.js";
import { cameras, comparing } from "../../core/state.js";
import { t } from "../../core/words.js";
import { version, versions } from "../versions/versions.js";
import { check, toCheck } from "./claims.js";

/**
 * @typedef {import("./types").Check} Check
 * @typedef {import("./types").Change} Change
 * @typedef {import("./types").Gate} Gate
 * @typedef {import("../../core/types").Calibration} Calibration
 * @typedef {{ of: string, gate: Gate | "wait", items: Check[], change: Change | null }} Found of: what was checked
 */

const NOTHING = /** @type {Found} */ ({ of: "", gate: "wait", items: [], change: null });

/** The active version of the camera, where it is another one. */
const former = computed(() => {
  const it = version.value,
    active = cameras.value.find((c) => c.id === it?.camera)?.active_calibration ?? null;
  return active === it?.id ? null : active;
});
/** What is to be checked: a version, beside the one that is active; "" while nobody looks. */
const wanted = computed(() =>
  comparing.value && version.value ? `${version.value.id} ${former.value ?? ""}` : "",
);

const found = signal(NOTHING);
let stop = new AbortController();
const shown = computed(() => (found.value.of === wanted.value ? found.value : NOTHING));

/** In the order of the checklist; empty while nothing is checked. */
export const checks = computed(() => shown.value.items);
/** How positions change against the active version. */
export const change = computed(() => shown.value.change);
/** Whether the version can be activated as it is, only after a warning, or not yet. */
export const gate = computed(() => shown.value.gate);
/** How many checks stand against activation. */
export const problemCount = computed(() => checks.value.filter((c) => c.isProblem).length);
/** How many could not be made. */
export const untestedCount = computed(
  () => checks.value.filter((c) => c.state === "unknown").length,
);

effect(() => {
  const of = wanted.value;
  untracked(() => (of ? void begin(of, /** @type {Calibration} */ (version.value)) : leave()));
});

/** Show at once what needs no picture, then all. @param {string} of @param {Calibration} it */
async function begin(of, it) {
  if (of === found.value.of) return;
  stop.abort();
  stop = new AbortController();
  const { signal: stopped } = stop,
    looking = check({ id: "lines", state: "running", title: t("verify.lines") });
  found.value = { ...NOTHING, of, items: [looking] };
  const show = (/** @type {Partial<Found>} */ more) => {
    if (!stopped.aborted) found.value = { ...found.value, ...more };
  };
  /** @type {Check[]} */
  let known = [];
  try {
    known = (await claimsOf(it, "?look=false", stopped)).items;
    show({ items: [looking, ...known] });
    show(await claimsOf(it, "", stopped));
    await showChange(it, stopped, show);
  } catch (error) {
    if (stopped.aborted) return;
    const refused = /** @type {Error} */ (error),
      failed = check({ ...looking, state: "unknown", text: refused.message });
    show({
      gate: "not-tested",
      items: [error instanceof Problem ? { ...failed, fix: error.fix } : failed, ...known],
    });
    if (!(error instanceof Problem || error instanceof ServerUnreachable)) throw error;
  }
}

/** What is not known yet will be asked for again; the rest is kept for whoever comes back. */
function leave() {
  if (found.value.gate !== "wait") return;
  stop.abort();
  found.value = NOTHING;
}

/** @param {Calibration} it @param {string} query @param {AbortSignal} stopped */
async function claimsOf(it, query, stopped) {
  const answer = await get(`/calibrations/${it.id}/claims${query}`, stopped);
  const items = answer.items.map((/** @type {import("./types").Claim} */ claim) =>
    toCheck(claim, it),
  );
  return { gate: /** @type {Gate} */ (answer.gate), items: /** @type {Check[]} */ (items) };
}

/** The map of what changes on the field, where the version differs from the active one.
 * @param {Calibration} it @param {AbortSignal} stopped @param {(more: Partial<Found>) => void} show */
async function showChange(it, stopped, show) {
  const other = former.value;
  if (!other || !found.value.items.some((c) => c.id === "difference" && c.state === "note")) return;
  const difference = await get(`/calibrations/${other}/difference/${it.id}.json`, stopped);
  const number = versions.value.find((v) => v.id === other)?.version;
  const from =
    number === undefined
      ? t("verify.former.active")
      : t("verify.former.version", { version: number });
  show({ change: { from, difference } });
}

/** @param {string} path @param {AbortSignal} stopped */
const get = async (path, stopped) => (await request("GET", path, { stop: stopped })).json();
