// The one way to make a version the active one of its camera: all that shows it learns of it, and it can be undone.
import { call } from "../../core/api.js";
import { cameras, notify, notifyError } from "../../core/state.js";
import { refreshStatuses } from "../live/camera_status.js";
import { noteActivated } from "./versions.js";

/** @typedef {{ id: string, version: number | null, camera: string | null }} Activated */

/**
 * @param {Activated} it
 * @returns {Promise<boolean>} whether it is active now; a refusal is shown
 */
export async function activateCalibration(it) {
  const camera = cameras.value.find((c) => c.id === it.camera) ?? null,
    former = camera?.active_calibration ?? null;
  try {
    await call("POST", `/calibrations/${it.id}/activate`);
  } catch (error) {
    notifyError(error);
    return false;
  }
  const at = cameras.value.findIndex((c) => c.id === camera?.id); // the list may be another one by now
  if (at >= 0) cameras.value = cameras.value.with(at, { ...cameras.value[at], active_calibration: it.id });
  noteActivated(it);
  notify({
    level: "info",
    text: `Version ${it.version} of ${camera?.name ?? "pictures from files"} is active.`,
    fix: former && former !== it.id ? "The version before it is kept." : "",
    action: former && former !== it.id ? { label: "Undo", run: () => void undo(it, former) } : undefined,
  });
  await refreshStatuses();
  return true;
}

/** Go back to the version that was active before. @param {Activated} it @param {string} former */
async function undo(it, former) {
  try {
    const { id, version, camera } = await call("GET", `/calibrations/${former}`);
    await activateCalibration({ id, version, camera: camera ?? it.camera });
  } catch (error) {
    notifyError(error);
  }
}
