// A rig: cameras that share a field. Which one is open, its stitched picture, its check and refit.
import { computed, effect, signal, untracked } from "@preact/signals";
import { call, changeSeen, request, toRefusal } from "../../core/api.js";
import { runJob } from "../../core/jobs.js";
import { longWork } from "../../core/long_work.js";
import { goInstead, route } from "../../core/route.js";
import { cameras, fields, listed, notify, notifyError } from "../../core/state.js";
import { t } from "../../core/words.js";
import { matchesOf } from "./kept_matches.js";

/**
 * @typedef {import("./types").Rig} Rig
 * @typedef {import("./types").RigCheck} Checked
 * @typedef {import("./types").Stitched} Stitched
 * @typedef {import("./types").Draft} Draft
 * @typedef {import("../../core/types").Refusal} Refusal
 */

const WIDTH_PX = 1200;
const AGAIN_MS = 2500,
  TRIES = 12; // for cameras that are waking up

export const rigs = signal(/** @type {Rig[]} */ ([]));
/** Whether the server has been asked for them. */
export const rigsListed = signal(false);
/**
 * picture: the address of its bytes, "" without; missing: cameras that are not in it.
 * @typedef {{ info: Stitched | null, picture: string, missing: string[], refusal: Refusal | null }} TakenPicture
 */
export const stitched = signal(/** @type {(TakenPicture & { of: string }) | null} */ (null));
/** The newest check, of which rig it was, and with what matches. */
export const rigCheck = signal(
  /** @type {{ of: string, matches: import("./types").SentMatches[], found: Checked } | null} */ (
    null
  ),
);
export const plane = signal(/** @type {"carpet" | "hat"} */ ("carpet"));
export const showMap = signal(true);
export const draft = signal(/** @type {Draft} */ ({ name: "", title: "", field: "", cameras: [] }));
export const draftRefusal = signal(/** @type {Refusal | null} */ (null));
export const { search, refusal, watch } = longWork();

/** The rig that the address names; "" a new one, null none. */
const name = computed(() => route.value.rig || (route.value.view === "new-rig" ? "" : null));
export const rig = computed(() => rigs.value.find((r) => r.name === name.value) ?? null);
export const found = computed(() =>
  rigCheck.value && rigCheck.value.of === name.value ? rigCheck.value.found : null,
);
/** Cameras that have other rectangles than the rig. */
export const others = computed(() =>
  (rig.value?.cameras ?? []).filter((c) =>
    c.troubles.some(({ reason }) => reason === "other-rectangles"),
  ),
);
/** The pair whose cameras are furthest apart on the plane that is shown. */
export const worst = computed(() => {
  const known = (found.value?.pairs ?? []).flatMap((p) => {
    const at = p.agreement?.[plane.value];
    return at ? [{ pair: p, at }] : [];
  });
  return known.reduce(
    (/** @type {typeof known[0] | null} */ best, it) =>
      !best || it.at.max_mm > best.at.max_mm ? it : best,
    null,
  );
});

/**
 * A next step, and where the operator is.
 * @param {string} action @param {string} label @param {string} sentence
 * @param {{ missing?: string, done?: boolean }} [more]
 */
export const step = (action, label, sentence, { missing = "", done = false } = {}) => ({
  action,
  label,
  missing,
  done,
  sentence,
});

/** Where the operator stands, and the next thing to do. */
export const rigNextStep = computed(() => {
  const missing = lacking.value,
    verdict = found.value?.verdict ?? rig.value?.checked?.verdict;
  if (!name.value)
    return step("make-rig", t("rig.make"), missing || t("rig.step.ready"), { missing });
  if (!rig.value) return step("step-camera", t("rig.step.back"), t("rig.step.no-such"));
  if (search.value) return stopStep();
  return verdict
    ? step("check-rig", t("rig.step.check-again"), verdict.sentence, {
        done: verdict.level === "good",
      })
    : step("check-rig", t("rig.check"), t("rig.step.unchecked"));
});
/** While something runs. */
export const stopStep = () =>
  step("stop-rig", t("common.stop"), search.value?.message || t("common.server-busy"));

/** What the form still wants. */
const lacking = computed(() => {
  const { name: called, field, cameras: chosen } = draft.value;
  if (!/^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$/.test(called)) return t("rig.lacking.name");
  if (!field) return t("rig.lacking.field");
  return chosen.length ? "" : t("rig.lacking.cameras");
});

/** @param {Partial<Draft>} changes */
export const setDraft = (changes) => {
  draft.value = { ...draft.value, ...changes };
};

/** Regions that suit so many cameras come first: halves for two, quarters for four. @param {string} id */
export function toggleCamera(id) {
  const now = draft.value.cameras,
    without = now.filter((c) => c.camera !== id);
  const region = cameras.value.find((c) => c.id === id)?.region ?? null;
  setDraft({ cameras: without.length < now.length ? without : [...now, { camera: id, region }] });
}

/** @param {string} id @param {string | null} region */
export const setRegion = (id, region) =>
  setDraft({ cameras: draft.value.cameras.map((c) => (c.camera === id ? { ...c, region } : c)) });

export async function loadRigs() {
  try {
    rigs.value = (await call("GET", "/rigs")).items;
  } catch (error) {
    notifyError(error);
  }
  rigsListed.value = true;
}

/** Begin a new one: the field of the address, else of the first camera that has one, with all cameras above it. */
function beginDraft() {
  draft.value = { name: "", title: "", field: "", cameras: [] };
  draftRefusal.value = null;
  const { field } = route.value,
    first = cameras.value.find((c) => c.field)?.field ?? fields.value[0]?.name ?? "";
  chooseField(field || first);
}

/** Another field has other cameras above it. @param {string} field */
export const chooseField = (field) =>
  setDraft({
    field,
    cameras: cameras.value
      .filter((c) => c.field === field)
      .map((c) => ({ camera: c.id, region: c.region })),
  });

export async function makeRig() {
  const { name: called, ...body } = draft.value;
  try {
    await request("PUT", `/rigs/${encodeURIComponent(called)}`, { json: body });
    await loadRigs();
    goInstead("rig", { rig: called });
  } catch (error) {
    draftRefusal.value = toRefusal(error);
  }
}

/** @param {Rig} it */
export async function removeRig(it) {
  try {
    await changeSeen(
      "DELETE",
      `/rigs/${encodeURIComponent(it.name)}`,
      (now) => now.updated_at === it.updated_at,
    );
    rigs.value = rigs.value.filter((r) => r.name !== it.name);
    goInstead("wall");
    notify({
      level: "info",
      text: t("rig.notice.removed", { rig: it.title || it.name }),
      fix: "",
      about: `rig/${it.name}`,
    });
  } catch (error) {
    notifyError(error);
    await loadRigs();
  }
}

/** All cameras in one picture; taken anew by itself while one that is calibrated is not in it yet. */
export async function takeStitched(tries = TRIES) {
  const of = name.value;
  if (!of) return;
  const taken = await stitchedOf(of).catch((error) => ({
    info: null,
    picture: "",
    missing: [],
    refusal: toRefusal(error),
  }));
  if (name.value !== of) return URL.revokeObjectURL(taken.picture);
  URL.revokeObjectURL(stitched.value?.picture ?? "");
  const now = (stitched.value = { of, ...taken });
  if (tries > 1 && !isWhole(now))
    setTimeout(() => {
      if (name.value === of && stitched.value === now) void takeStitched(tries - 1);
    }, AGAIN_MS);
}

/** Where things lie in the picture, then its bytes: a refusal of the one is one of the other. @param {string} of */
async function stitchedOf(of) {
  const at = `/rigs/${encodeURIComponent(of)}/stitched`,
    /** @type {Stitched} */ info = await call("GET", `${at}.json?width=${WIDTH_PX}`),
    answer = await request("GET", `${at}.jpg?width=${WIDTH_PX}`);
  return {
    info,
    picture: URL.createObjectURL(await answer.blob()),
    missing: (answer.headers.get("X-Rig-Missing") ?? "").split(","),
    refusal: null,
  };
}

/** @param {{ picture: string, missing: string[] }} taken */
const isWhole = ({ picture, missing }) =>
  (rig.value?.cameras ?? []).every(
    (c) => !c.calibration || (picture && !missing.includes(c.camera)),
  );

/** With new images of all cameras, and with what is matched in two. */
export async function checkRig() {
  const it = rig.value;
  if (!it || search.value) return;
  const of = it.name,
    matches = matchesOf(it);
  await watch(
    (stop, onProgress) =>
      runJob(`/rigs/${encodeURIComponent(of)}/check?job=true`, { matches }, stop, onProgress),
    async (result) => {
      rigCheck.value = { of, matches, found: result };
      await loadRigs();
      void takeStitched();
    },
  );
}

/** Cameras with other rectangles, refitted as new versions; none is activated. */
export async function refitRig() {
  const of = name.value;
  if (!of || search.value) return;
  await watch(
    (stop, onProgress) => runJob(`/rigs/${encodeURIComponent(of)}/refit`, {}, stop, onProgress),
    (/** @type {{ calibrations: string[] }} */ { calibrations: { length: count } }) =>
      notify({
        level: "info",
        text: t("rig.notice.refitted", { count }),
        fix: t("rig.notice.refitted.fix"),
        about: `rig/${of}`,
      }),
  );
}

export const stopRig = () => search.value?.stop.abort();

/** Another rig's picture is none of this one, and what was refused is of the view that was left. */
export function startRig() {
  effect(() => {
    const at = name.value,
      isListed = listed.value,
      { view } = route.value;
    untracked(() => {
      refusal.value = null;
      if (at === null || !isListed) return;
      if (!at) beginDraft();
      else if (!rigs.value.some((r) => r.name === at)) void loadRigs();
      if (view !== "rig" || stitched.value?.of === at) return;
      plane.value = "carpet";
      void takeStitched();
    });
  });
  effect(() => {
    void cameras.value; // another version is active, or a camera came
    if (listed.value) void untracked(loadRigs);
  });
}
