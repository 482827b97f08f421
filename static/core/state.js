// State of the page besides the document: lists from the server, the picture, what is selected and shown.
import { computed, effect, signal, untracked } from "@preact/signals";
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

// How long a notice outlives the view it was made in: so that what led to the next view can still be read there, and
// what was removed can still be put back.
const READ_MS = 10_000,
  UNDO_MS = 300_000;
let lastNotice = 0;
export const notices = signal(/** @type {import("./types").Notice[]} */ ([]));

/**
 * Tell the operator something that stays until it is dismissed, or left behind with the view.
 * @param {Omit<import("./types").Notice, "id" | "at">} notice
 */
export function notify(notice) {
  const added = { ...notice, id: ++lastNotice, at: Date.now() };
  notices.value = [...notices.value.filter((n) => n.text !== notice.text), added];
}

/** What belonged to the view that was left. */
function leaveView() {
  help.value = ""; // it lies where another view has its results
  const now = Date.now();
  notices.value = notices.value.filter(({ at, action }) => now - at < (action ? UNDO_MS : READ_MS));
}
effect(() => {
  if (shown.value) untracked(leaveView);
});

/** Tell what went wrong, with its fix. @param {unknown} error */
export function notifyError(error) {
  const { message, fix, status } =
    /** @type {{ message: string, fix?: string, status?: number }} */ (error);
  const action =
    status === 401
      ? { label: t("core.state.sign-in"), run: () => location.assign("/login") }
      : undefined;
  notify({
    level: "warn",
    text: message,
    fix: fix ?? t("core.state.error.fix"),
    action,
  });
}

/** @param {number} id */
export const dismiss = (id) => {
  notices.value = notices.value.filter((n) => n.id !== id);
};
