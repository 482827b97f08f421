// The one way to make a version the active one of its camera: what the server holds against it is asked about first,
// all that shows it learns of it, and it can be undone.
import { effect, signal, untracked } from "@preact/signals";
import { Problem, call, request } from "../../core/api.js";
import { cameras, notify, notifyError, retract } from "../../core/state.js";
import { t } from "../../core/words.js";
import { readCameras } from "../calibrate/pictures.js";
import { refreshStatuses } from "../live/camera_status.js";
import { noteActivated } from "./versions.js";

/**
 * @typedef {{ id: string, version: number | null, camera: string | null }} Activated
 * @typedef {import("../verify/types").Claim} Claim
 * @typedef {{ it: Activated, claims: Claim[], answer: (isAnyway: boolean) => void }} Warning claims: those that stand
 * against it
 */

/** What the operator is asked; null while nothing is. */
export const warning = signal(/** @type {Warning | null} */ (null));

/** Which version is active, by camera, as far as lists of versions know it. */
let told = new Map();

// Whoever activates a version, here or elsewhere: all that shows versions learns of it.
effect(() => {
  const now = new Map(cameras.value.map((c) => [c.id, c.active_calibration]));
  untracked(() => {
    for (const [camera, id] of now)
      if (told.has(camera) && told.get(camera) !== id) {
        retract(aboutActive(camera)); // it says that another one is active
        noteActivated({ id, camera });
      }
  });
  told = now;
});

/**
 * Activate it unless something stands against it, or another version was activated since the page last heard; then ask.
 * @param {Activated} it
 * @param {string[]} [despite] codes of claims that the operator accepts
 * @param {string | null} [former] the version that was active when the operator decided
 * @returns {Promise<boolean>} whether it is active now; a refusal is shown
 */
export async function activateCalibration(it, despite = [], former = activeOf(it)) {
  const camera = cameraOf(it);
  try {
    const seen = { headers: { "If-Match": former ?? "none" } };
    await request("POST", `/calibrations/${it.id}/activate`, {
      json: { despite },
      ...(camera ? seen : {}),
    });
  } catch (error) {
    if (error instanceof Problem && Array.isArray(error.body.claims))
      return (
        (await isWanted(it, error.body.claims)) &&
        activateCalibration(it, error.body.despite, former)
      );
    await refuse(it, error, despite);
    return false;
  }
  const at = cameras.value.findIndex((c) => c.id === camera?.id); // the list may be another one by now
  if (at >= 0)
    cameras.value = cameras.value.with(at, { ...cameras.value[at], active_calibration: it.id });
  if (!camera) noteActivated(it);
  notify({
    level: "info",
    text: camera
      ? t("versions.activated", { version: String(it.version), camera: camera.name })
      : t("versions.activated-from-files", { version: String(it.version) }),
    fix: former && former !== it.id ? t("versions.activated.fix") : "",
    about: aboutActive(it.camera),
    action:
      former && former !== it.id
        ? { label: t("common.undo"), run: () => void undo(it, former) }
        : undefined,
  });
  await refreshStatuses();
  return true;
}

/** What notices of a camera's active version are about. @param {string | null} camera */
const aboutActive = (camera) => `active/${camera ?? ""}`;
const cameraOf = (/** @type {Activated} */ it) =>
  cameras.value.find((c) => c.id === it.camera) ?? null;
const activeOf = (/** @type {Activated} */ it) => cameraOf(it)?.active_calibration ?? null;

/** Ask whether it is to be activated in spite of these claims. @param {Activated} it @param {Claim[]} claims */
const isWanted = (it, claims) =>
  new Promise((/** @type {(isAnyway: boolean) => void} */ answer) => {
    warning.value?.answer(false);
    warning.value = { it, claims, answer };
  });

/** Answer the question that is open. @param {Warning} asked @param {boolean} isAnyway */
export function answerWarning(asked, isAnyway) {
  if (warning.value === asked) warning.value = null;
  asked.answer(isAnyway);
}

/**
 * Say why not; where somebody else was faster, with that version on show.
 * @param {Activated} it
 * @param {unknown} error
 * @param {string[]} despite
 */
async function refuse(it, error, despite) {
  if (!(error instanceof Problem) || error.status !== 412)
    return notifyError(error, aboutActive(it.camera));
  await readCameras().catch(() => {});
  notify({
    level: "warn",
    text: error.detail,
    fix: error.fix,
    about: aboutActive(it.camera),
    action: {
      label: t("versions.activate-all-the-same", { version: String(it.version) }),
      run: () => void activateCalibration(it, despite),
    },
  });
}

/** Go back to the version that was active before. @param {Activated} it @param {string} former */
async function undo(it, former) {
  try {
    const { id, version, camera } = await call("GET", `/calibrations/${former}`);
    await activateCalibration({ id, version, camera: camera ?? it.camera });
  } catch (error) {
    notifyError(error, aboutActive(it.camera));
  }
}
