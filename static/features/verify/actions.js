// Activating the version on show: at once where every check is fine, else after a warning.
import { computed, signal } from "@preact/signals";
import { go } from "../../core/route.js";
import { comparing } from "../../core/state.js";
import { t } from "../../core/words.js";
import { activateCalibration } from "../versions/activate.js";
import { isSaved, version } from "../versions/versions.js";
import { gate } from "./checks.js";

/** The warning that is open: each time another one, so that a late event of a former one does not close it. */
const warned = signal(/** @type {{ of: string } | null} */ (null));
export const openWarning = computed(() =>
  warned.value?.of === version.value?.id && comparing.value && gate.value === "warn" ? warned.value : null,
);

/** @param {{ of: string } | null} [warning] the one that is open, where none is named */
export const closeWarning = (warning = warned.value) => {
  if (warned.value === warning) warned.value = null;
};

/** Activate it whatever the checks say, and go back to the cameras. */
export async function activateAnyway() {
  const it = version.value;
  closeWarning();
  if (!it || !(await activateCalibration(it))) return;
  if (comparing.value && version.value?.id === it.id) go("wall"); // nobody went elsewhere meanwhile
}

/** The primary button while the version is not active. */
export const activationNextStep = computed(() => {
  const number = String(version.value?.version),
    name = t("common.activate-version", { version: number }),
    step = (/** @type {string} */ label, missing = "") => ({ action: "activate", label, missing });
  if (!isSaved.value) return step(name, t("verify.save-first"));
  if (gate.value === "wait") return step(t("verify.checking"), t("verify.not-complete"));
  return step(gate.value === "warn" ? t("verify.activate-version-anyway", { version: number }) : name);
});

/** @type {import("../../core/actions.js").Action[]} */
export const VERIFY_ACTIONS = [
  {
    id: "activate",
    label: t("verify.action.activate"),
    short: t("verify.action.activate.short"),
    group: "steps",
    run: () => {
      if (gate.value === "ok") void activateAnyway();
      else if (version.value) warned.value = { of: version.value.id };
    },
    enabled: () => isSaved.value && !version.value?.active && gate.value !== "wait",
  },
];
