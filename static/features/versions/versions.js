// Saved versions of the calibration of this picture: immutable.
import { computed, signal } from "@preact/signals";
import { call, changeSeen, request } from "../../core/api.js";
import { doc, isEqual } from "../../core/document.js";
import { requestOrder } from "../../core/latest_wins.js";
import { goToStep } from "../../core/route.js";
import { busy, models, notifyError, rotation, snapshot } from "../../core/state.js";
import { t } from "../../core/words.js";
import { fitBody, fittedPoints } from "../calibrate/fitting.js";

/** The newest version of this picture, and its neighbours of the same camera; without a camera, of the same picture. */
export const version = signal(/** @type {import("../../core/types").Calibration | null} */ (null));
export const versions = signal(/** @type {import("../../core/types").Calibration[]} */ ([]));
export const revision = signal(0);
/** The way to stop the saving that is under way: a fit of many points takes a while. */
export const saving = signal(/** @type {AbortController | null} */ (null));

/** Whether the saved version is what the document says now. */
export const isSaved = computed(() => {
  const saved = version.value,
    now = doc.value;
  return (
    saved !== null &&
    !saved.field_changes?.length &&
    saved.field === now.field &&
    saved.region === now.region &&
    saved.rotate === rotation.value &&
    (now.model === null ? "model_choice" in saved.report : saved.model.name === now.model) &&
    isEqual(
      given(saved.options),
      given(now.model === null ? optionsOf(saved.model.name, now.options) : now.options),
    ) &&
    isEqual(saved.observations.map(plain), fittedPoints(now).map(plain))
  );
});

/** Whether its model was chosen before the models were compared. */
export const isUncompared = computed(
  () => version.value?.report.model_choice?.ranking.length === 0,
);

/**
 * Options that say something, in one order; a lens by its id, for a version keeps the lens itself.
 * @param {Record<string, any>} options
 */
const given = (options) =>
  Object.entries(options)
    .filter(([, v]) => v !== null)
    .map(([name, v]) => [name, v.id ?? v])
    .toSorted();

/** Those that a model has: of the others, a version that was chosen automatically was told nothing.
 * @param {string} name @param {Record<string, any>} options */
const optionsOf = (name, options) => {
  const known = models.value.find((m) => m.name === name)?.options.map((o) => o.name) ?? [];
  return Object.fromEntries(Object.entries(options).filter(([option]) => known.includes(option)));
};

/** @param {import("../../core/types").Observation} o */
const plain = ({ feature, kind, points, z_mm = 0 }) => [feature, kind, points, z_mm];

/** Save what the document gives as a new version, unless the newest one is just that; then compare. It is saved as the
 * present fit shows it: which model is best is found out afterwards. */
export async function saveVersion() {
  if (busy.value) return; // asked for twice, it would be two versions
  if (!isSaved.value) {
    busy.value = t("versions.saving");
    const picture = snapshot.value?.id,
      stop = new AbortController();
    saving.value = stop;
    try {
      const camera = snapshot.value?.camera;
      const body = { ...fitBody(doc.value), ...(camera ? { camera } : {}), compare: false };
      const saved = await (
        await request("POST", "/calibrations", { json: body, stop: stop.signal })
      ).json();
      const isLeft = () => snapshot.value?.id !== picture; // then it stands among that picture's versions
      if (isLeft()) return;
      version.value = saved;
      await list();
      if (isLeft()) return;
    } catch (error) {
      if (!stop.signal.aborted) notifyError(error);
      return;
    } finally {
      busy.value = "";
      saving.value = null;
    }
  }
  goToStep("verify");
}

/**
 * Show which version is active from now on. revision: counts such changes, for lists that are kept elsewhere.
 * @param {{ id: string | null, camera: string | null }} it
 */
export function noteActivated({ id, camera }) {
  const now = (/** @type {import("../../core/types").Calibration} */ v) =>
    v.camera === camera ? { ...v, active: v.id === id } : v;
  versions.value = versions.value.map(now);
  if (version.value) version.value = now(version.value);
  revision.value += 1;
}

/**
 * Change the note beside a version, as long as it is the one on show.
 * @param {{ id: string, note: string }} it
 * @param {string} note
 */
export const writeNote = (it, note) =>
  changeSeen("PATCH", `/calibrations/${it.id}`, (now) => now.note === it.note, { note });

/** Change the note of the version on show. @param {import("../../core/types").Calibration} it @param {string} note */
export async function annotateVersion(it, note) {
  if (note === it.note) return;
  await writeNote(it, note).catch(notifyError);
  try {
    const now = await call("GET", `/calibrations/${it.id}`);
    if (version.value?.id === it.id) version.value = { ...version.value, ...now };
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
    if (snapshot.value?.id === picture && version.value === null)
      version.value = { ...found, field_changes: newest.field_changes };
  } catch (error) {
    notifyError(error);
  }
}

export function forgetVersion() {
  lists.begin(); // what is on its way is of the former picture
  version.value = null;
  versions.value = [];
}

const lists = requestOrder();

async function list() {
  const { camera = null, id = "" } = snapshot.value ?? {},
    isNewest = lists.begin(),
    of = camera ? `camera=${encodeURIComponent(camera)}` : `snapshot=${id}`;
  const found = await call("GET", `/calibrations?brief=true&limit=20&${of}`);
  if (isNewest()) versions.value = found.items;
}
