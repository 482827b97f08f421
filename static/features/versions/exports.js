// Export formats of a version, fetched when the menu is opened.
import { signal } from "@preact/signals";
import { call } from "../../core/api.js";
import { notifyError } from "../../core/state.js";

/** Of one version; null while nothing is known. */
export const formats = signal(
  /** @type {{ id: string, items: import("../../core/types").Format[] } | null} */ (null),
);

/** @param {string} id of a calibration */
export async function askFormats(id) {
  if (formats.value?.id === id) return;
  try {
    const { items } = await call("GET", `/calibrations/${id}/exports`);
    formats.value = { id, items };
  } catch (error) {
    notifyError(error);
  }
}
