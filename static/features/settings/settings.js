// The server's settings and disk usage, and what this browser stores.
import { computed, signal } from "@preact/signals";
import { call } from "../../core/api.js";
import { chooseName, operatorName } from "../../core/operator.js";
import { notifyError } from "../../core/state.js";

export { chooseName, operatorName };

/** As the server said last. */
export const serverSettings = signal(/** @type {import("./types").ServerSettings | null} */ (null));
export const health = signal(/** @type {import("./types").Health | null} */ (null));

export const settingsNextStep = computed(() => {
  const now = health.value,
    wrong = now ? now.warnings.length + now.damaged.length : 0;
  return {
    action: "back",
    label: "Back",
    missing: "",
    done: wrong === 0,
    sentence: !now
      ? "Asking the server…"
      : wrong
        ? "Something needs care: it stands at the top."
        : "The server says that all is well.",
  };
});

export async function fetchSettings() {
  try {
    [serverSettings.value, health.value] = await Promise.all([
      call("GET", "/settings"),
      call("GET", "/health"),
    ]);
  } catch (error) {
    notifyError(error);
  }
}

/** What this browser keeps of ours. */
export const storedKeys = () => Object.keys(localStorage).filter((key) => key.startsWith("touchline"));

/** Forget preferences and lists, but no clicks that the server has not got. */
export function forgetPreferences() {
  for (const key of storedKeys()) if (!key.startsWith("touchline.draft.")) localStorage.removeItem(key);
  location.reload();
}
