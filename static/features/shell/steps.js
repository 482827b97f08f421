// The three steps: state of each, what is missing in one sentence, and the next action.
import { computed } from "@preact/signals";
import { BORDERS, doc, pointsOf } from "../../core/document.js";
import { plural } from "../../core/format.js";
import { route } from "../../core/route.js";
import { active, camera, nextCamera, region, snapshot, step } from "../../core/state.js";
import { finding } from "../calibrate/find_lines.js";
import { preview, refusal, stale } from "../calibrate/fitting.js";
import { activationNextStep } from "../verify/actions.js";
import { isSaved, version } from "../versions/versions.js";
import { viewNextStep } from "./next_steps.js";
import { badCamera } from "./problems.js";

/**
 * @typedef {import("../../core/types").StepId} StepId
 * @typedef {{ id: StepId, label: string, done: boolean, open: boolean, sentence: string }} Step
 */

export const POINTS_ADVISED = 5; // a cubic needs four; the fifth checks it

/** @type {{ id: StepId, label: string }[]} */
export const STEPS = [
  { id: "field", label: "Field" },
  { id: "points", label: "Points" },
  { id: "verify", label: "Verify & activate" },
];

/** The first border after the active one that wants more points. */
export const nextBorder = computed(() => {
  const start = BORDERS.indexOf(/** @type {import("../../core/types").Border} */ (active.value));
  const turn = BORDERS.map((_, i) => BORDERS[(start + i + BORDERS.length) % BORDERS.length]);
  return turn.find((b) => pointsOf(doc.value, b).length < POINTS_ADVISED) ?? null;
});

const fitted = computed(() => preview.value !== null && refusal.value === null);

/** @type {import("@preact/signals").ReadonlySignal<Step[]>} */
export const steps = computed(() => {
  const state = { field: fieldState(), points: pointsState(), verify: verifyState() };
  return STEPS.map(({ id, label }) => {
    const [done, sentence] = state[/** @type {keyof typeof state} */ (id)];
    return { id, label, done, open: snapshot.value !== null, sentence };
  });
});

/** Where the page is while no picture is open. @type {Step} */
const START = {
  id: "",
  label: "Cameras",
  done: false,
  open: true,
  sentence: "Choose a camera, or open an image.",
};

/** @returns {[boolean, string]} */
function fieldState() {
  const picture = snapshot.value;
  if (!picture) return [false, "No image is open."];
  return region.value
    ? [true, `${picture.width} × ${picture.height} px. Check the field type and the area this camera covers.`]
    : [false, "Choose the field type and the area this camera covers."];
}

/** @returns {[boolean, string]} */
function pointsState() {
  if (!snapshot.value) return [false, "No image is open."];
  if (finding.value) return [false, "Detecting the field lines."];
  if (fitted.value) return [true, "Fit complete. See the accuracy on the right."];
  const border = nextBorder.value;
  if (border) {
    const missing = POINTS_ADVISED - pointsOf(doc.value, border).length;
    return [
      false,
      `Mark ${plural(missing, missing < POINTS_ADVISED ? "more point" : "point")} along the ${border} border.`,
    ];
  }
  return [false, refusal.value ? `${refusal.value.detail} ${refusal.value.fix}` : "Computing the fit."];
}

/** @returns {[boolean, string]} */
function verifyState() {
  const it = version.value;
  if (!it) return [false, "Save a version to verify it."];
  if (!isSaved.value) return [false, "The points have changed since the last version was saved."];
  if (it.active) return [true, `Version ${it.version} is active.`];
  if (!camera.value) return [true, `Version ${it.version} is saved. Download it, or use it over REST.`];
  return [false, `Version ${it.version} is saved but not active.`];
}

export const current = computed(() => steps.value.find((s) => s.id === step.value) ?? START);

/** The primary button: which action, in which words, and why not yet. */
export const nextAction = computed(() => {
  /** @param {string} action @param {string} label @param {string} [missing] */
  const thing = (action, label, missing = "") => ({ action, label, missing });
  switch (step.value) {
    case "":
      if (route.value.view !== "wall") return viewNextStep.value ?? thing("", "");
      if (badCamera.value) return thing("fix-camera", `Fix ${badCamera.value.name}…`);
      return nextCamera.value
        ? thing("take", `Calibrate ${nextCamera.value.name}`)
        : thing("open", "Open an image…");
    case "field":
      return thing("step-points", "Continue", region.value ? "" : current.value.sentence);
    case "points": {
      if (finding.value) return thing("step-verify", "Detecting lines…", "Wait, or stop the detection.");
      const border = nextBorder.value;
      if (!fitted.value && border && border !== active.value)
        return thing(`border-${border}`, `Next: ${border} border`);
      if (isSaved.value) return thing("step-verify", "Continue");
      return thing("save", "Continue", fitted.value && !stale.value ? "" : current.value.sentence);
    }
    default:
      if (!isSaved.value) return thing("step-points", "Back: save the changes");
      return camera.value && version.value && !version.value.active
        ? activationNextStep.value
        : thing("step-camera", "Done, back to cameras");
  }
});
