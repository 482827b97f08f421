// Opens a picture: from a file, the clipboard, a camera, or the saved ones.
import { batch, computed, effect, signal, untracked } from "@preact/signals";
import { call, request } from "../../core/api.js";
import { EMPTY, doc, load } from "../../core/document.js";
import { requestOrder } from "../../core/latest_wins.js";
import { go, goInstead, route } from "../../core/route.js";
import {
  active,
  busy,
  cameras,
  fields,
  listed,
  models,
  notices,
  notify,
  notifyError,
  retract,
  selection,
  snapshot,
  snapshots,
} from "../../core/state.js";
import { t } from "../../core/words.js";
import { fit } from "../../canvas/viewport.js";
import { applyChosenLens } from "../boards/board.js";
import { importFile, isCalibrationFile } from "../versions/imports.js";
import { findVersion, forgetVersion } from "../versions/versions.js";
import { closeDraft, fetchDraft, openDraft } from "./draft.js";

const SPREAD_MS = 1000 / 3; // between two frames of a background, as the server spreads them

/** @type {Promise<void>} */
let lists = Promise.resolve();

/** How far the watching of many frames is, and the way to stop it. */
export const backgroundProgress = signal(
  /** @type {{ share: number, stop: AbortController } | null} */ (null),
);

/** Lists that the page is built from; one that fails leaves the others standing. */
export function loadLists() {
  lists = fetchLists();
  return lists;
}

async function fetchLists() {
  const fill = async (/** @type {string} */ path, /** @type {(items: any[]) => void} */ keep) => {
    try {
      keep((await call("GET", path)).items);
    } catch (error) {
      notifyError(error);
    }
  };
  await Promise.all([
    readFields().catch(notifyError),
    fill("/models", (items) => {
      models.value = items;
    }),
    fill("/cameras", (items) => {
      cameras.value = items;
    }),
    fill("/snapshots?limit=12&purpose=picture", (items) => {
      snapshots.value = items;
    }),
  ]);
  listed.value = true;
}

let fieldsRevision = "";

export async function readFields() {
  const { items, revision } = await call("GET", "/fields");
  fields.value = items;
  fieldsRevision = revision;
}

/** Ask for the fields again where somebody has changed one, and for the cameras: calibrations may be outdated by it.
 * @param {string} revision as it is now */
export async function refreshFields(revision) {
  if (!listed.value || revision === fieldsRevision) return;
  await readFields();
  await readCameras();
}

/**
 * Ask for the cameras again where the list is not what their statuses say: another operator added one, or activated a
 * version.
 * @param {{ id: string, active_calibration: string | null }[]} now
 */
export async function refreshCameras(now) {
  const shown = cameras.value.map((it) => `${it.id} ${it.active?.id ?? null}`).join();
  if (listed.value && shown !== now.map((it) => `${it.id} ${it.active_calibration}`).join())
    await readCameras();
}

export async function readCameras() {
  cameras.value = (await call("GET", "/cameras")).items;
}

/**
 * Upload a file and work on it; what holds a calibration is kept as a version.
 * @param {Blob & { name?: string }} file
 */
export async function openFile(file) {
  if (isCalibrationFile(file)) return importFile(file);
  const body = new FormData();
  body.append("file", file, file.name || "picture");
  await openFrom(
    file.name
      ? t("calibrate.pictures.opening", { name: file.name })
      : t("calibrate.pictures.opening-unnamed"),
    async () => (await request("POST", "/snapshots", { body })).json(),
  );
}

/**
 * Take a picture from a camera and work on it. frames: 1, or so many of which the background is taken.
 * @param {string} id
 * @param {number} [frames]
 */
export async function takePicture(id, frames = 1) {
  if (frames === 1)
    return openFrom(t("calibrate.pictures.taking"), () =>
      call("POST", "/snapshots", { camera: id }),
    );
  if (busy.value) return;
  const stop = new AbortController(),
    begun = Date.now(),
    total = frames * SPREAD_MS;
  const tick = setInterval(() => {
    backgroundProgress.value = { share: Math.min(1, (Date.now() - begun) / total), stop };
  }, 200);
  backgroundProgress.value = { share: 0, stop };
  try {
    await openFrom(
      t("calibrate.pictures.watching"),
      async () =>
        (
          await request("POST", "/snapshots", { json: { camera: id, frames }, stop: stop.signal })
        ).json(),
      () => stop.signal.aborted,
    );
  } finally {
    clearInterval(tick);
    backgroundProgress.value = null;
  }
}

const openings = requestOrder();

/**
 * @param {string} doing
 * @param {() => Promise<import("../../core/types").Snapshot>} fetchIt
 * @param {() => boolean} [stopped] whether a failure is the operator's own wish
 */
async function openFrom(doing, fetchIt, stopped = () => false) {
  if (busy.value) return;
  busy.value = doing;
  const from = route.value,
    isNewest = openings.begin();
  try {
    const picture = await fetchIt();
    await lists; // a picture opened before the fields are known would be given none
    snapshots.value = [picture, ...snapshots.value.filter((s) => s.id !== picture.id)];
    notices.value = [];
    const step = knownPlace(picture, EMPTY).region ? "points" : "field";
    if (!(await openSnapshot(picture, step, () => isNewest() && route.value === from)))
      tellThatItIsThere(picture, step);
  } catch (error) {
    if (!stopped()) notifyError(error, "picture");
  } finally {
    busy.value = "";
  }
}

/** Nobody who went elsewhere meanwhile is taken back. @param {import("../../core/types").Snapshot} picture
 * @param {import("../../core/types").StepId} step */
const tellThatItIsThere = (picture, step) =>
  notify({
    level: "info",
    text: t("calibrate.pictures.is-there"),
    fix: "",
    about: "picture",
    action: {
      label: t("calibrate.pictures.open-it"),
      run: () => go("calibrate", { picture: picture.id, step }),
    },
  });

/**
 * Work on a kept picture, where its draft stands; return whether it was still wanted once that was known.
 * @param {import("../../core/types").Snapshot} picture
 * @param {import("../../core/types").StepId} at where to begin
 * @param {() => boolean} isWanted not where the operator went elsewhere, or asked for another one
 */
async function openSnapshot(picture, at, isWanted) {
  const kept = await fetchDraft(picture.id);
  if (!isWanted()) return false;
  retract("picture");
  // At once: nothing may see one picture with another's clicks, nor an address that is another one's.
  batch(() => {
    closePicture();
    openDraft(picture.id, kept);
    load({ ...doc.value, ...knownPlace(picture, doc.value) });
    snapshot.value = picture;
    active.value = "left";
    if (route.value.picture !== picture.id) go("calibrate", { picture: picture.id, step: at });
  });
  fit(picture);
  // what it was begun with may be there no more
  if (kept.notice && !(kept.doc.field && kept.doc.region))
    goInstead("calibrate", { picture: picture.id, step: "field" });
  applyChosenLens(picture);
  await findVersion(picture.id);
  return true;
}

/** The picture that the address names. @param {string} id */
async function openById(id) {
  const isNewest = openings.begin(),
    isWanted = () => isNewest() && route.value.picture === id;
  try {
    await lists;
    const picture = await call("GET", `/snapshots/${encodeURIComponent(id)}`);
    await openSnapshot(picture, route.value.step, isWanted);
  } catch (error) {
    if (!isWanted()) return;
    goInstead("wall");
    const { message } = /** @type {Error} */ (error);
    notify({
      level: "warn",
      text: t("calibrate.pictures.not-opened", { error: message }),
      fix: t("calibrate.pictures.not-opened.fix"),
      about: "picture",
    });
  }
}

let opened = Promise.resolve();
/** Go to a picture, and return when it is open. @param {string} id @param {import("../../core/types").StepId} step */
export function openPicture(id, step) {
  go("calibrate", { picture: id, step });
  return opened;
}

/** Open the picture that the address names, and close it when the page goes elsewhere. */
export function startPictures() {
  const wanted = computed(() => route.value.picture);
  effect(() => {
    const id = wanted.value;
    untracked(() => {
      if (id === (snapshot.value?.id ?? "")) return;
      closePicture(); // its draft is kept; nothing unseen shall be changed by a key
      if (id) opened = openById(id);
    });
  });
}

function closePicture() {
  snapshot.value = null;
  selection.value = [];
  closeDraft();
  forgetVersion();
}

/** What the camera is said to cover, else what its active version does; otherwise the image is to tell.
 * @param {import("../../core/types").Snapshot} picture @param {import("../../core/types").Doc} said
 * @returns {Partial<import("../../core/types").Doc>} */
function knownPlace(picture, said) {
  if (said.field && said.region) return {};
  const camera = cameras.value.find((c) => c.id === picture.camera),
    known = camera?.field ? { ...camera, rotate: null } : camera?.active,
    place =
      !said.field || said.field === known?.field ? known : { ...said, region: null, rotate: null },
    field = fields.value.find((f) => f.name === place?.field),
    region = field?.regions[place?.region ?? ""];
  return {
    field: field?.name ?? null,
    region: region?.name ?? null,
    rotate: region && place?.rotate !== region.rotate ? (place?.rotate ?? null) : null,
  };
}
