// Activating the version on show: the server asks back where something stands against it.
import { computed } from "@preact/signals";
import { go } from "../../core/route.js";
import { busy, comparing } from "../../core/state.js";
import { t } from "../../core/words.js";
import { activateCalibration } from "../versions/activate.js";
import { isSaved, version } from "../versions/versions.js";
import { gate } from "./checks.js";
import { offer, saveRecommended } from "./model_offer.js";

/** Activate it, and go back to the cameras. */
async function activateShown() {
  const it = version.value;
  if (!it || !(await activateCalibration(it))) return;
  if (comparing.value && version.value?.id === it.id) go("wall"); // nobody went elsewhere meanwhile
}

/** The primary button while the version is not active. */
export const activationNextStep = computed(() => {
  const number = String(version.value?.version),
    name = t("common.activate-version", { version: number }),
    step = (/** @type {string} */ label, missing = "") => ({ action: "activate", label, missing });
  if (gate.value === "wait") return step(t("verify.checking"), t("verify.not-complete"));
  return step(
    gate.value === "problems" ? t("verify.activate-version-anyway", { version: number }) : name,
  );
});

/** @type {import("../../core/actions.js").Action[]} */
export const VERIFY_ACTIONS = [
  {
    id: "activate",
    label: t("verify.action.activate"),
    short: t("verify.action.activate.short"),
    group: "steps",
    run: () => void activateShown(),
    enabled: () => isSaved.value && !version.value?.active && gate.value !== "wait",
  },
  {
    id: "save-recommended",
    label: t("verify.action.save-recommended"),
    short: t("verify.action.save-recommended.short"),
    group: "steps",
    run: () => void saveRecommended(),
    enabled: () => offer.value.better !== null && !busy.value,
  },
];
