// Actions that go from step to step; the primary button runs "next".
import { run } from "../../core/actions.js";
import { go, goToStep } from "../../core/route.js";
import { STEPS, nextAction, steps } from "./steps.js";

/** @type {import("../../core/actions.js").Action[]} */
export const STEP_ACTIONS = [
  {
    id: "step-camera",
    label: "Go to the cameras",
    short: "Cameras",
    run: () => go("wall"),
  },
  ...STEPS.map(({ id, label }) => ({
    id: `step-${id}`,
    label: `Go to ${label.toLowerCase()}`,
    run: () => goToStep(id),
    enabled: () => steps.value.find((s) => s.id === id)?.open ?? false,
  })),
  {
    id: "next",
    label: "Continue (primary button)",
    keys: ["Enter"],
    group: "Steps",
    run: () => run(nextAction.value.action),
    // a version is activated by its button alone: Enter, pressed once too often, must not
    enabled: () => !nextAction.value.missing && nextAction.value.action !== "activate",
  },
];
