// Saved versions of the calibration of this picture: immutable.
import { computed, signal } from "@preact/signals";
import { call } from "../../core/api.js";
import { doc, isEqual } from "../../core/document.js";
import { requestOrder } from "../../core/latest_wins.js";
import { busy, notifyError, rotation, snapshot, step } from "../../core/state.js";
import { fitBody } from "../calibrate/fitting.js";

/** The newest version of this picture, and its neighbours of the same camera. */
export const version = signal(/** @type {import("../../core/types").Calibration | null} */ (null));
export const versions = signal(/** @type {import("../../core/types").Calibration[]} */ ([]));
export const note = signal("");

/** Whether the saved version is what the document says now. */
export const isSaved = computed(() => {
  const saved = version.value,
    now = doc.value;
  return (
    saved !== null &&
    saved.field === now.field &&
    saved.region === now.region &&
    saved.rotate === rotation.value &&
    saved.model.name === now.model &&
    isEqual(given(saved.options), given(now.options)) &&
    isEqual(saved.observations.map(plain), now.observations.map(plain))
  );
});

/**
 * Options that say something, in one order; a lens by its id, for a version keeps the lens itself.
 * @param {Record<string, any>} options
 */
const given = (options) =>
  Object.entries(options)
    .filter(([, v]) => v !== null)
    .map(([name, v]) => [name, v.id ?? v])
    .toSorted();

/** @param {import("../../core/types").Observation} o */
const plain = ({ feature, kind, points, z_mm = 0 }) => [feature, kind, points, z_mm];

/** Save what the document gives as a new version, unless the newest one is just that; then compare. */
export async function saveVersion() {
  if (busy.value) return; // asked for twice, it would be two versions
  if (!isSaved.value) {
    busy.value = "Saving the calibration…";
    const picture = snapshot.value?.id;
    try {
      const camera = snapshot.value?.camera;
      const body = { ...fitBody(doc.value), ...(camera ? { camera } : {}), note: note.value };
      const saved = await call("POST", "/calibrations", body);
      if (snapshot.value?.id !== picture) return; // it stands among the versions of the picture that was left
      version.value = saved;
      note.value = "";
      await list();
    } catch (error) {
      notifyError(error);
      return;
    } finally {
      busy.value = "";
    }
  }
  step.value = "compare";
}

/** @param {string} id */
export async function activate(id) {
  try {
    await call("POST", `/calibrations/${id}/activate`);
    if (version.value?.id === id) version.value = { ...version.value, active: true };
    await list();
  } catch (error) {
    notifyError(error);
  }
}

/** After a reload: the newest version that came from this picture. @param {string} picture */
export async function findVersion(picture) {
  try {
    await list();
    const newest = versions.value.find((v) => v.snapshot === picture);
    if (!newest || snapshot.value?.id !== picture) return;
    const found = await call("GET", `/calibrations/${newest.id}`);
    // one may have been saved meanwhile
    if (snapshot.value?.id === picture && version.value === null) version.value = found;
  } catch (error) {
    notifyError(error);
  }
}

export function forgetVersion() {
  lists.begin(); // what is on its way is of the former picture
  version.value = null;
  versions.value = [];
  note.value = "";
}

const lists = requestOrder();

async function list() {
  const camera = snapshot.value?.camera,
    isNewest = lists.begin();
  const found = await call(
    "GET",
    `/calibrations?limit=20${camera ? `&camera=${encodeURIComponent(camera)}` : ""}`,
  );
  if (isNewest()) versions.value = found.items;
}
