// Colour profiles: learned from clicks and boxes or automatically, saved as presets, copied to another camera.
import { computed, effect, signal } from "@preact/signals";
import { call, changeSeen, request } from "../../core/api.js";
import { cameras, notify, notifyError, retract } from "../../core/state.js";
import { nameOr, t } from "../../core/words.js";
import { detectionCamera, detectionState, setDetection, tune } from "./detection.js";
import { asSnapshot } from "./held_frame.js";

/**
 * @typedef {import("./types").Profile} Profile
 * @typedef {import("./types").Place} Place
 * @typedef {import("./types").Preset} Preset
 */

export const BACKGROUND = "background";
/**
 * Every colour that can be taught, as the leagues have them; each with a picture of itself.
 * @type {[string, string][]}
 */
export const COLOURS = [
  ["orange", "#fa701e"],
  ["yellow", "#f6d628"],
  ["blue", "#1860d2"],
  ["pink", "#fa5cbe"],
  ["green", "#6ee85c"],
  ["cyan", "#3cd6de"],
  ["purple", "#7834d6"],
  ["red", "#de1e2c"],
  [BACKGROUND, "#4a5b52"],
];
/** What a reader calls a colour. @param {string} name */
export const colourName = (name) => nameOr(`detection.colour.${name}`, name);
const READ_NEAR = ["pink", "green"]; // by the butterfly patterns, without being looked for everywhere
const DOUBT_MS = 5000;

/** What the next click teaches; "" nothing. */
export const colour = signal("");
/** Being taught, and the way to stop it. */
export const learning = signal(
  /** @type {{ what: string, stop: AbortController } | null} */ (null),
);
/** What the server said of it. */
export const notes = signal(/** @type {string[]} */ ([]));
export const presets = signal(/** @type {Preset[]} */ ([]));
/** The preset whose saving over has been asked for once. */
export const overwriteCandidate = signal("");

/** Colours that the plan looks for, or that were taught. */
export const neededColours = computed(() => {
  const it = detectionState.value,
    names = new Set(Object.keys(it?.profile?.colours ?? {}));
  for (const stage of it?.plan.stages ?? []) {
    for (const option of ["everywhere", "numbers", "teams"])
      for (const name of /** @type {string[]} */ (stage[option] ?? [])) names.add(name);
    if (stage.stage === "ball") names.add(String(stage.colour));
    if (stage.stage === "butterfly") for (const name of READ_NEAR) names.add(name);
  }
  return names;
});

/** @param {string} name */
export const choose = (name) => {
  colour.value = colour.value === name ? "" : name;
};

let queue = Promise.resolve();

/** Teach the chosen colour what is there: in the held frame, or in the one of now. @param {Place} place raw px */
export function teach(place) {
  const name = colour.value;
  if (!name) return;
  queue = queue.then(() =>
    learn(t("detection.colours.learning", { colour: colourName(name) }), () => ({
      clicks: { [name]: [place] },
      ...(detectionState.value?.profile ? { base: detectionState.value.profile } : {}),
    })),
  );
}

/** All colours from the picture's own patches, without a click. */
export const learnAutomatically = () => {
  queue = queue.then(() => learn(t("detection.colours.looking"), () => ({ automatic: true })));
};

/**
 * @param {string} what
 * @param {() => Record<string, unknown>} body made when its turn has come, onto what was learned before
 */
async function learn(what, body) {
  const id = detectionCamera.value?.id;
  if (!id || !detectionState.value) return;
  const stop = new AbortController();
  learning.value = { what, stop };
  try {
    const snapshot = await asSnapshot();
    const response = await request("POST", `/cameras/${encodeURIComponent(id)}/colours/learn`, {
      json: { ...body(), snapshot },
      stop: stop.signal,
    });
    const answer = await response.json();
    if (detectionCamera.value?.id !== id) return;
    notes.value = answer.notes;
    await tune({ profile: named(answer.profile) });
  } catch (error) {
    if (!stop.signal.aborted) notifyError(error);
  } finally {
    learning.value = null;
  }
}

/** A camera's own profile does not go by the name of the one that it shares with others. @param {Profile} profile */
function named(profile) {
  const shared = detectionState.value?.colours;
  return {
    ...profile,
    name: shared ? `${shared}, changed` : (detectionCamera.value?.id ?? "clicked"),
  };
}

/** Take one sample away again. @param {string} name @param {number} index */
export function forget(name, index) {
  const it = detectionState.value?.profile;
  if (!it) return;
  const without = (/** @type {import("./types").Sample[]} */ samples) =>
    samples.filter((_, i) => i !== index);
  if (name === BACKGROUND) {
    void tune({ profile: named({ ...it, background: without(it.background) }) });
    return;
  }
  const left = Object.entries({ ...it.colours, [name]: without(it.colours[name] ?? []) }).filter(
    ([, samples]) => samples.length,
  );
  void tune(
    left.length
      ? { profile: named({ ...it, colours: Object.fromEntries(left) }) }
      : { profile: null, colours: null },
  );
}

/** Without any of them: the camera finds its colours by itself, in each first picture. */
export const forgetAll = () => tune({ profile: null, colours: null });

/** @param {string} name */
export const usePreset = (name) => tune({ profile: null, colours: name || null });

/** What is typed, as an address can hold it. @param {string} text */
export const presetName = (text) =>
  text
    .trim()
    .replace(/[^A-Za-z0-9._-]+/g, "-")
    .replace(/^[-._]+/, "")
    .slice(0, 64);

let doubt = 0;

/**
 * Keep what this camera goes by under a name; over another of that name only when asked for twice.
 * @param {string} typed
 */
export async function savePreset(typed) {
  const name = presetName(typed),
    profile = detectionState.value?.profile,
    at = `/colours/${encodeURIComponent(name)}`;
  if (!name || !profile) return;
  const shown = presets.value.find((p) => p.name === name);
  clearTimeout(doubt);
  if (shown && overwriteCandidate.value !== name) {
    overwriteCandidate.value = name;
    doubt = setTimeout(() => {
      overwriteCandidate.value = "";
    }, DOUBT_MS);
    return;
  }
  overwriteCandidate.value = "";
  try {
    const wanted = { profile: { ...profile, name } };
    await (shown
      ? changeSeen("PUT", at, (now) => now.updated_at === shown.updated_at, wanted)
      : request("PUT", at, { json: wanted }));
    await readPresets();
    await tune({ colours: name, profile: null });
  } catch (error) {
    notifyError(error);
    await readPresets(); // somebody else may have changed them
  }
}

/** @param {string} name */
export async function removePreset(name) {
  const old = presets.value.find((p) => p.name === name),
    at = `/colours/${encodeURIComponent(name)}`;
  try {
    await changeSeen("DELETE", at, (now) => now.updated_at === old?.updated_at);
    await readPresets();
    const again = () =>
      call("PUT", at, { profile: old?.profile }).then(() => {
        retract(`preset/${name}`);
        return readPresets();
      }, notifyError);
    notify({
      level: "info",
      text: t("detection.presets.removed", { preset: name }),
      fix: "",
      about: `preset/${name}`,
      action: old
        ? { label: t("detection.presets.removed.put-back"), run: () => void again() }
        : undefined,
    });
  } catch (error) {
    notifyError(error);
    await readPresets();
  }
}

/** Let another camera go by the same colours. @param {string} id */
export async function copyTo(id) {
  const it = detectionState.value,
    other = cameras.value.find((c) => c.id === id),
    at = `/cameras/${encodeURIComponent(id)}/seeing`;
  if (!it || !other) return;
  const shared = it.colours && it.profile?.name === it.colours;
  /** @param {Record<string, unknown>} colours @returns {Promise<Record<string, unknown>>} what it went by before */
  const put = async (colours) => {
    const response = await request("GET", at),
      { on, plan, publish, ...theirs } = await response.json();
    await request("PUT", at, {
      json: { on, plan, publish, ...colours },
      headers: { "If-Match": response.headers.get("ETag") ?? "" },
    });
    return {
      colours: theirs.colours,
      profile:
        theirs.learned === "clicks" && theirs.profile?.name !== theirs.colours
          ? theirs.profile
          : null,
    };
  };
  try {
    const before = await put({
      colours: shared ? it.colours : null,
      profile: shared ? null : it.profile,
    });
    notify({
      level: "info",
      text: t("detection.presets.copied", { camera: other.name }),
      fix: "",
      about: `colours/${id}`,
      action: {
        label: t("detection.presets.copied.take-back"),
        run: () => void put(before).then(() => retract(`colours/${id}`), notifyError),
      },
    });
    await readPresets();
  } catch (error) {
    notifyError(error);
  }
}

export async function readPresets() {
  try {
    presets.value = (await call("GET", "/colours")).items;
  } catch (error) {
    notifyError(error);
  }
}

/** Know the presets as long as the page is there. */
export function startColours() {
  const current = computed(() => detectionCamera.value?.id);
  effect(() => {
    colour.value = "";
    notes.value = [];
    if (current.value) void readPresets();
  });
}

/** @param {boolean} on */
export const publish = (on) => setDetection({ publish: on });
