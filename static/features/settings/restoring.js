// Going back to the newest good backup: what that would be, and doing it.
import { computed, signal } from "@preact/signals";
import { call } from "../../core/api.js";
import { notifyError } from "../../core/state.js";
import { health, serverSettings } from "./settings.js";

/** @typedef {import("./types").Restoration} Restoration */

/** What would be restored, once somebody has asked. */
export const restoration = signal(/** @type {Restoration | null} */ (null));
/** Whether a backup of the server's own may have intact what is damaged: some rows, or the whole database. */
export const canRestore = computed(
  () =>
    Boolean(serverSettings.value?.storage.backups) &&
    ((health.value?.damaged ?? []).some((one) => one.restorable) ||
      (health.value?.warnings ?? []).some((one) => one.reason === "database-damaged")),
);

export const findRestoration = () => ask({});

export function forgetRestoration() {
  restoration.value = null;
}

/** Restore what was agreed to; this page and all others then read everything anew. @param {Restoration} agreed */
export async function restoreBackup({ backup, database }) {
  await ask({ backup, database });
  if (restoration.value?.file) location.reload();
}

/** @param {{ backup?: number, database?: number }} agreed */
async function ask(agreed) {
  restoration.value = null;
  try {
    restoration.value = await call("POST", "/restore-backup", agreed);
  } catch (error) {
    notifyError(error);
  }
}
