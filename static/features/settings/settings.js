// The server's settings and disk usage, and what this browser stores.
import { computed, signal } from "@preact/signals";
import { call } from "../../core/api.js";
import { chooseName, operatorName } from "../../core/operator.js";
import { notifyError } from "../../core/state.js";

export { chooseName, operatorName };

/** As the server said last. */
export const serverSettings = signal(/** @type {import("./types").ServerSettings | null} */ (null));
/** Whether a token is wanted of whoever comes. */
export const isGuarded = computed(() =>
  Boolean(serverSettings.value?.items.find((s) => s.name === "token")?.value),
);
export const health = signal(/** @type {import("./types").Health | null} */ (null));

/** Ask how the server is. Who is no longer signed in is told only that it answers, and keeps what was known. */
export async function fetchHealth() {
  const told = await call("GET", "/health");
  if (told.version) health.value = told;
}

export async function fetchSettings() {
  try {
    [serverSettings.value] = await Promise.all([call("GET", "/settings"), fetchHealth()]);
  } catch (error) {
    notifyError(error);
  }
}

/** What this browser keeps of ours. */
export const storedKeys = () =>
  Object.keys(localStorage).filter((key) => key.startsWith("touchline"));

/** Forget preferences and lists, but no clicks that the server has not got. */
export function forgetPreferences() {
  for (const key of storedKeys())
    if (!key.startsWith("touchline.draft.")) localStorage.removeItem(key);
  location.reload();
}
