// Actions that go from step to step; the bright button runs "next".
import { run } from "../../core/actions.js";
import { step } from "../../core/state.js";
import { STEPS, nextAction, steps } from "./steps.js";

/** @type {import("../../core/actions.js").Action[]} */
export const STEP_ACTIONS = [
  ...STEPS.map(({ id, label }) => ({
    id: `step-${id}`,
    label: `Go to ${label.toLowerCase()}`,
    run: () => {
      step.value = id;
    },
    enabled: () => steps.value.find((s) => s.id === id)?.open ?? false,
  })),
  {
    id: "next",
    label: "Do the next thing (the bright button)",
    keys: ["Enter"],
    group: "Steps",
    run: () => run(nextAction.value.action),
    enabled: () => !nextAction.value.missing,
  },
];
