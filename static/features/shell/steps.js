// The three steps: state of each, what is missing in one sentence, and the next action.
import { computed } from "@preact/signals";
import { BORDERS, doc, pointsOf } from "../../core/document.js";
import { areaName, lineName, mm } from "../../core/format.js";
import { route } from "../../core/route.js";
import {
  active,
  camera,
  field,
  nextCamera,
  region,
  rotation,
  snapshot,
  step,
} from "../../core/state.js";
import { t } from "../../core/words.js";
import { withoutDetected } from "../automatic/detected_points.js";
import { detectedAreas, fieldChoices, finding } from "../automatic/find_lines.js";
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
  { id: "field", label: t("shell.step.field") },
  { id: "points", label: t("shell.step.points") },
  { id: "verify", label: t("shell.step.verify") },
];

/** The first border after the active one that wants more points. */
export const nextBorder = computed(() => {
  const start = BORDERS.indexOf(/** @type {import("../../core/types").Border} */ (active.value));
  const turn = BORDERS.map((_, i) => BORDERS[(start + i + BORDERS.length) % BORDERS.length]);
  return turn.find((b) => pointsOf(doc.value, b).length < POINTS_ADVISED) ?? null;
});

const fitted = computed(() => preview.value !== null && refusal.value === null);
const isDetected = computed(
  () =>
    doc.value.observations.length > 0 &&
    withoutDetected(snapshot.value?.id, doc.value.observations).length === 0,
);
const USABLE = new Set(["good", "fair"]);
/** Whether the field was recognised, and points on its lines are sure and fit well: nothing is left to do here. */
const isRecognised = computed(
  () =>
    step.value === "field" && // elsewhere points are dragged, and nobody asks
    region.value !== null &&
    isDetected.value &&
    (stale.value || (fitted.value && USABLE.has(preview.value?.report.verdict.level ?? ""))),
);

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
  label: t("shell.place.cameras"),
  done: false,
  open: true,
  sentence: t("shell.sentence.choose-camera"),
};

/** @returns {[boolean, string]} */
function fieldState() {
  const picture = snapshot.value;
  if (!picture) return [false, t("shell.sentence.no-image")];
  if (finding.value && !region.value) return [false, t("shell.sentence.recognising")];
  if (fieldChoices.value.length) return [false, t("shell.sentence.choose-shown")];
  if (!region.value) return [false, t("shell.sentence.choose-field")];
  const error = stale.value ? null : preview.value?.report.sigma_mm;
  return [
    true,
    isRecognised.value
      ? t("shell.sentence.recognised", {
          field: field.value?.title ?? "",
          area: areaName(region.value.name),
          degrees: rotation.value,
          error: error ? t("shell.sentence.recognised.error", { mm: mm(error.rms) }) : "",
        })
      : t("shell.sentence.check-field", { width: picture.width, height: picture.height }),
  ];
}

/** @returns {[boolean, string]} */
function pointsState() {
  if (!snapshot.value) return [false, t("shell.sentence.no-image")];
  if (finding.value) return [false, t("shell.sentence.detecting")];
  if (!region.value) return [false, t("shell.sentence.choose-field")];
  if (fitted.value) return [true, t("shell.sentence.fit-complete")];
  if (detectedAreas.value.length) return [false, t("shell.sentence.other-area")];
  const border = nextBorder.value;
  if (border) {
    const missing = POINTS_ADVISED - pointsOf(doc.value, border).length;
    const key = missing < POINTS_ADVISED ? "shell.sentence.mark-more" : "shell.sentence.mark";
    return [false, t(key, { count: missing, border: lineName(border) })];
  }
  return [
    false,
    refusal.value ? `${refusal.value.detail} ${refusal.value.fix}` : t("shell.sentence.computing"),
  ];
}

/** @returns {[boolean, string]} */
function verifyState() {
  const it = version.value;
  if (!it) return [false, t("shell.sentence.save-first")];
  if (!isSaved.value) return [false, t("shell.sentence.draft-differs", { version: it.version })];
  if (it.active) return [true, t("shell.sentence.version-active", { version: it.version })];
  if (!camera.value) return [true, t("shell.sentence.version-saved", { version: it.version })];
  return [false, t("shell.sentence.version-inactive", { version: it.version })];
}

export const current = computed(() => steps.value.find((s) => s.id === step.value) ?? START);

/** The primary button: which action, in which words, and why not yet. */
export const nextAction = computed(() => {
  /** @param {string} action @param {string} label @param {string} [missing] */
  const thing = (action, label, missing = "") => ({ action, label, missing });
  switch (step.value) {
    case "":
      if (route.value.view !== "wall") return viewNextStep.value ?? thing("", "");
      if (badCamera.value)
        return thing("fix-camera", t("shell.next.fix-camera", { camera: badCamera.value.name }));
      return nextCamera.value
        ? thing("take", t("common.calibrate-camera", { camera: nextCamera.value.name }))
        : thing("open", t("shell.next.open-image"));
    case "field":
      if (finding.value)
        return thing("step-points", t("shell.next.detecting"), t("shell.next.detecting.missing"));
      if (!region.value)
        return thing("step-points", t("shell.next.choose-field"), current.value.sentence);
      if (!isRecognised.value) return thing("step-points", t("shell.next.continue"));
      return thing(
        "save",
        t("shell.next.use-it"),
        stale.value ? t("shell.sentence.computing") : "",
      );
    case "points": {
      if (finding.value)
        return thing("step-verify", t("shell.next.detecting"), t("shell.next.detecting.missing"));
      if (!region.value) return thing("step-field", t("shell.next.choose-field"));
      const [area, another] = detectedAreas.value;
      if (area && !fitted.value)
        return another
          ? thing("use-area", t("shell.next.choose-area"), t("shell.sentence.other-area"))
          : thing("use-area", t("shell.next.use-area", { area: areaName(area.region) }));
      const border = nextBorder.value;
      if (!fitted.value && border && border !== active.value)
        return thing(`border-${border}`, t("shell.next.border", { border: lineName(border) }));
      if (isSaved.value) return thing("step-verify", t("shell.next.continue"));
      return thing(
        "save",
        t("shell.next.continue"),
        fitted.value && !stale.value ? "" : current.value.sentence,
      );
    }
    default:
      if (!isSaved.value) return thing("step-points", t("shell.next.save-changes"));
      return camera.value && version.value && !version.value.active
        ? activationNextStep.value
        : thing("step-camera", t("shell.next.done"));
  }
});
