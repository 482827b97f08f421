// New versions for images that are turned by quarters since.
import { call } from "../../core/api.js";
import { busy, notify, notifyError } from "../../core/state.js";
import { t } from "../../core/words.js";
import { activateCalibration } from "./activate.js";
import { revision } from "./versions.js";

/** Clockwise, by degrees. */
export const TURNS = [
  { degrees: 90, label: t("versions.turn.clockwise") },
  { degrees: 180, label: t("versions.turn.half") },
  { degrees: 270, label: t("versions.turn.counter-clockwise") },
];

/**
 * Save a turned version beside the one that it is made from.
 * @param {{ id: string, version: number }} it @param {number} degrees
 */
export async function turnVersion(it, degrees) {
  if (busy.value) return; // asked for twice, it would be two versions
  busy.value = t("versions.saving");
  try {
    const made = await call("POST", `/calibrations/${it.id}/turned`, { turn: degrees });
    revision.value += 1;
    notify({
      level: "info",
      text: t("versions.turned", { version: made.version, former: it.version }),
      fix: t("versions.turned.when"),
      about: `version/${made.id}`,
      action: made.camera
        ? { label: t("versions.activate"), run: () => void activateCalibration(made) }
        : undefined,
    });
  } catch (error) {
    notifyError(error);
  } finally {
    busy.value = "";
  }
}
