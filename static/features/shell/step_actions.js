// Actions that go from step to step; the primary button runs "next".
import { run } from "../../core/actions.js";
import { inSentence } from "../../core/format.js";
import { go, goToStep } from "../../core/route.js";
import { t } from "../../core/words.js";
import { STEPS, nextAction, steps } from "./steps.js";

/** @type {import("../../core/actions.js").Action[]} */
export const STEP_ACTIONS = [
  {
    id: "step-camera",
    label: t("shell.action.step-camera"),
    short: t("shell.action.step-camera.short"),
    run: () => go("wall"),
  },
  ...STEPS.map(({ id, label }) => ({
    id: `step-${id}`,
    label: t("shell.action.go-to-step", { step: inSentence(label) }),
    run: () => goToStep(id),
    enabled: () => steps.value.find((s) => s.id === id)?.open ?? false,
  })),
  {
    id: "next",
    label: t("shell.action.next"),
    keys: ["Enter"],
    group: "steps",
    run: () => run(nextAction.value.action),
    // a version is activated by its button alone: Enter, pressed once too often, must not
    enabled: () => !nextAction.value.missing && nextAction.value.action !== "activate",
  },
];
