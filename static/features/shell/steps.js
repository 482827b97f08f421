// The six steps: state of each, what is missing in one sentence, and the next action.
import { computed } from "@preact/signals";
import { BORDERS, doc, pointsOf } from "../../core/document.js";
import { plural } from "../../core/format.js";
import { page } from "../../core/page.js";
import {
  active,
  atBoard,
  atLive,
  atPair,
  atStraight,
  camera,
  cameras,
  region,
  snapshot,
  step,
} from "../../core/state.js";
import { boardNextStep } from "../board/board.js";
import { preview, refusal, stale } from "../calibrate/fitting.js";
import { cameraNextStep } from "../live/camera_page.js";
import { pairNextStep } from "../pair/evaluation.js";
import { straightNextStep } from "../straight/straight.js";
import { isSaved, version } from "../versions/versions.js";
import { pageNextStep } from "./page_steps.js";

/**
 * @typedef {import("../../core/types").StepId} StepId
 * @typedef {{ id: StepId, label: string, done: boolean, open: boolean, sentence: string }} Step
 */

export const POINTS_ADVISED = 5; // a cubic needs four; the fifth checks it

/** @type {{ id: StepId, label: string }[]} */
export const STEPS = [
  { id: "camera", label: "Camera" },
  { id: "picture", label: "Picture" },
  { id: "borders", label: "Borders" },
  { id: "model", label: "Model" },
  { id: "compare", label: "Compare" },
  { id: "activate", label: "Activate" },
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
  const picture = snapshot.value,
    has = picture !== null;
  const state = {
    camera: has
      ? [true, camera.value ? `The picture comes from ${camera.value.name}.` : "The picture is a file."]
      : [false, "Take a picture with a camera, or open one."],
    picture: !picture
      ? [false, "No picture yet."]
      : region.value
        ? [
            true,
            `${picture.width} × ${picture.height} px. Check that the field and its part are the right ones.`,
          ]
        : [false, "Choose the field and the part of it that the camera sees."],
    borders: bordersState(),
    model: fitted.value
      ? [true, "It fits; what it is worth stands beside it."]
      : [false, refusal.value ? refusal.value.detail : "Click the borders first."],
    compare: isSaved.value
      ? [true, "Borders should be straight on the corrected side, and lines should lie on the paint."]
      : [
          false,
          version.value
            ? "The clicks have changed since the last version was saved."
            : "Nothing is saved to compare yet.",
        ],
    activate: activateState(),
  };
  return STEPS.map(({ id, label }) => {
    const [done, sentence] = /** @type {[boolean, string]} */ (state[id]);
    return { id, label, done, open: isOpen(id), sentence };
  });
});

/** @returns {[boolean, string]} */
function bordersState() {
  if (!snapshot.value) return [false, "No picture yet."];
  const border = nextBorder.value;
  if (border) {
    const missing = POINTS_ADVISED - pointsOf(doc.value, border).length;
    return [
      false,
      `Click ${plural(missing, missing < POINTS_ADVISED ? "more point" : "point")} along the ${border} border.`,
    ];
  }
  if (refusal.value) return [false, `${refusal.value.detail} ${refusal.value.fix}`];
  return [fitted.value, fitted.value ? "All four borders are clicked." : "The fit is being computed."];
}

/** @returns {[boolean, string]} */
function activateState() {
  const it = version.value;
  if (!it) return [false, "Save a version first."];
  if (it.active) return [true, `Version ${it.version} is active.`];
  if (!camera.value) return [true, `Version ${it.version} is saved. Download it, or use it over REST.`];
  return [false, `Version ${it.version} is saved; the camera does not use it yet.`];
}

/** @param {StepId} id */
function isOpen(id) {
  return id === "camera" || snapshot.value !== null; // whatever is missing there is said there
}

export const current = computed(() => steps.value.find((s) => s.id === step.value) ?? steps.value[0]);

/** The one bright button: which action, in which words, and why not yet. */
export const nextAction = computed(() => {
  /** @param {string} action @param {string} label @param {string} [missing] */
  const thing = (action, label, missing = "") => ({ action, label, missing });
  switch (step.value) {
    case "camera":
      if (page.value) return pageNextStep.value;
      if (atLive.value !== null) return cameraNextStep.value;
      if (atBoard.value) return boardNextStep.value;
      if (atStraight.value) return straightNextStep.value;
      if (atPair.value) return pairNextStep.value;
      return snapshot.value
        ? thing("step-picture", "Next: picture")
        : cameras.value.length
          ? thing("take", `Take a picture with ${cameras.value[0].name}`)
          : thing("open", "Open a picture…");
    case "picture":
      return thing("step-borders", "Next: borders", region.value ? "" : current.value.sentence);
    case "borders": {
      const border = nextBorder.value;
      if (border && border !== active.value) return thing(`border-${border}`, `Next: ${border} border`);
      return thing("step-model", "Next: model", fitted.value ? "" : current.value.sentence);
    }
    case "model":
      if (isSaved.value) return thing("step-compare", "Next: compare");
      return thing("save", "Save and compare", !fitted.value || stale.value ? current.value.sentence : "");
    case "compare":
      return isSaved.value
        ? thing("step-activate", "Next: activate")
        : thing("step-model", "Back: save the changes");
    default:
      return camera.value && version.value && !version.value.active
        ? thing("activate", `Activate version ${version.value.version}`)
        : thing("step-camera", "Next: another picture");
  }
});
