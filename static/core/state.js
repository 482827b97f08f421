// State of the page besides the document: lists from the server, the picture, what is selected and shown.
import { computed, effect, signal, untracked } from "@preact/signals";
import { SILENT, answered, online } from "./api.js";
import { doc, pointsOf } from "./document.js";
import { route } from "./route.js";
import { t } from "./words.js";

/** @typedef {import("./types").Pick} Pick */

/** The step of calibrating that the page is at; "" elsewhere. */
export const step = computed(() => route.value.step);

export const fields = signal(/** @type {import("./types").Field[]} */ ([]));
export const models = signal(/** @type {import("./types").Model[]} */ ([]));
export const cameras = signal(/** @type {import("./types").Camera[]} */ ([]));
/** The first camera that has no active version yet, else the first of all. */
export const nextCamera = computed(
  () => cameras.value.find((c) => !c.active_calibration) ?? cameras.value[0] ?? null,
);
export const snapshots = signal(/** @type {import("./types").Snapshot[]} */ ([]));
/** The picture that is being worked on. */
export const snapshot = signal(/** @type {import("./types").Snapshot | null} */ (null));
/** What is under way, in words: "Opening the picture…". */
export const busy = signal("");

/** What the next click lies on: a border, or a line, arc or landmark of the field. */
export const active = signal("left");
export const selection = signal(/** @type {Pick[]} */ ([]));
export const tool = signal(/** @type {"pick" | "pan"} */ ("pick"));
/** Where the pointer is, in picture pixels; touch: the loupe must get out from under a finger. */
export const pointer = signal(
  /** @type {{ x: number, y: number, touch: boolean, down: boolean } | null} */ (null),
);
export const box = signal(
  /** @type {{ x0: number, y0: number, x1: number, y1: number } | null} */ (null),
);
export const showLines = signal(false);
export const help = signal(/** @type {"" | "manual" | "keys"} */ (""));
const shown = computed(() => `${route.value.view}/${route.value.picture}`);

/** Whether the lists from the server are there. */
export const listed = signal(false);
/** Whether what the address names is not there yet: until then nothing else is shown in its place. */
export const opening = computed(
  () =>
    (!listed.value && route.value.view !== "wall") ||
    (route.value.view === "calibrate" && snapshot.value === null) ||
    route.value.view === "former-pair", // it leads on
);
/** The camera that the address names. */
export const namedCamera = computed(
  () => cameras.value.find((c) => c.id === route.value.camera) ?? null,
);
/** Whether the address leads nowhere: there is no such page, or no such camera. Versions outlive theirs. */
export const isNowhere = computed(
  () =>
    route.value.view === "nowhere" ||
    (listed.value &&
      route.value.camera !== "" &&
      !namedCamera.value &&
      route.value.view !== "versions"),
);

/** Compare: what is shown, what beside the clicks, and where the wipe stands as a share of the stage's width. */
export const compare = signal(
  /** @type {{ mode: import("./types").CompareMode, editing: import("./types").CompareMode, at: number }} */ ({
    mode: "wipe",
    editing: "raw",
    at: 0.5,
  }),
);

export const field = computed(() => fields.value.find((f) => f.name === doc.value.field) ?? null);
export const region = computed(
  () => (doc.value.region && field.value?.regions[doc.value.region]) || null,
);
/** How far the field is turned in the picture: the operator's choice, else the region's own. */
export const rotation = computed(() => doc.value.rotate ?? region.value?.rotate ?? 0);
export const camera = computed(
  () => cameras.value.find((c) => c.id === snapshot.value?.camera) ?? null,
);
/** What the server chose for the present points, where the operator leaves the model to it. */
export const automaticModel = signal(/** @type {string | null} */ (null));
/** The name of the model that is used. */
export const modelName = computed(() => doc.value.model ?? automaticModel.value);
export const model = computed(() => models.value.find((m) => m.name === modelName.value) ?? null);
/** What a model is called, as the server says; its name where the server has none of that name. @param {string} name */
export const modelTitle = (name) => models.value.find((m) => m.name === name)?.title ?? name;
export const editing = computed(() => snapshot.value !== null && step.value === "points");

/**
 * Whether a feature of the field is one spot, or anywhere along a line.
 * @param {string} feature
 * @returns {"line" | "landmark"}
 */
export const kindOf = (feature) =>
  field.value && feature in field.value.landmarks ? "landmark" : "line";

/** Whether raw and corrected are shown. */
export const comparing = computed(() => step.value === "verify");

/** The selected points that still exist. */
export const selectedPoints = computed(() =>
  selection.value.filter((p) => p.index < pointsOf(doc.value, p.feature).length),
);

// How long a notice can be read: information goes by itself, and a view takes its notices along once they could be
// read. What was removed can be put back for longer.
const READ_MS = 10_000,
  UNDO_MS = 300_000;
let lastNotice = 0;
export const notices = signal(/** @type {import("./types").Notice[]} */ ([]));

/**
 * Show a notice. It replaces what was said before about the same subject, so that no two contradict each other.
 * @param {Omit<import("./types").Notice, "id" | "at">} notice
 */
export function notify(notice) {
  const added = { ...notice, id: ++lastNotice, at: Date.now() };
  notices.value = [...notices.value.filter((n) => !isReplaced(n, notice)), added];
}

/** @param {import("./types").Notice} old @param {{ text: string, about?: string }} now */
const isReplaced = (old, { text, about }) =>
  old.text === text || (about !== undefined && old.about === about);

/**
 * Remove what is no longer so.
 * @param {string} about @param {import("./types").Notice["level"]} [level] of these only
 */
export function retract(about, level) {
  const left = notices.value.filter((n) => n.about !== about || (level && n.level !== level));
  if (left.length < notices.value.length) notices.value = left;
}

/** Remove information that could be read; warnings stay until they are dismissed or their cause is mended. */
export function expireNotices() {
  const now = Date.now(),
    left = notices.value.filter((n) => n.level !== "info" || now - n.at < timeOf(n));
  if (left.length < notices.value.length) notices.value = left;
}

/** Begin their time again: the pointer or the focus was on them. */
export function renewNotices() {
  notices.value = notices.value.map((n) => ({ ...n, at: Date.now() }));
}

/** @param {import("./types").Notice} notice */
const timeOf = ({ action }) => (action ? UNDO_MS : READ_MS);

/** What belonged to the view that was left. */
function leaveView() {
  help.value = ""; // it lies where another view has its results
  const now = Date.now();
  notices.value = notices.value.filter((n) => now - n.at < timeOf(n));
}
effect(() => {
  if (shown.value) untracked(leaveView);
});

// What the server refused, or did not answer, is mended once it answers the same request.
effect(() => {
  const { about } = answered.value;
  untracked(() => retract(about, "warn"));
});
effect(() => {
  if (online.value) untracked(() => retract(SILENT, "warn"));
});

/**
 * Say what went wrong, with its fix.
 * @param {unknown} error
 * @param {string} [subject] what it is about, where a notice says more of the same
 */
export function notifyError(error, subject) {
  const { message, fix, status, about } =
    /** @type {{ message: string, fix?: string, status?: number, about?: string }} */ (error);
  const action =
    status === 401
      ? { label: t("core.state.sign-in"), run: () => location.assign("/login") }
      : undefined;
  notify({
    level: "warn",
    text: message,
    fix: fix ?? t("core.state.error.fix"),
    about: about === SILENT ? SILENT : (subject ?? about),
    action,
  });
}

/** @param {number} id */
export const dismiss = (id) => {
  notices.value = notices.value.filter((n) => n.id !== id);
};
