// The tour: one picture from camera to activation, explained with its own numbers.
import { computed, effect, signal } from "@preact/signals";
import { BORDERS, doc, pointsOf } from "../../core/document.js";
import { mm, number, pct, plural, words } from "../../core/format.js";
import { camera, cameras, field, model, region, rotation, snapshot } from "../../core/state.js";
import { curves, isCurve, preview } from "../calibrate/fitting.js";
import { ranking } from "../calibrate/model_ranking.js";
import { statuses } from "../live/camera_status.js";
import { POINTS_ADVISED } from "../shell/steps.js";
import { isSaved, version } from "../versions/versions.js";

/**
 * @typedef {object} Stop
 * @property {string} id
 * @property {import("../../core/types").StepId} step where it is
 * @property {import("../../core/folds.js").Fold} [fold] what is unfolded for it
 * @property {string} at what it points at: a CSS selector
 * @property {string} title
 * @property {string} text what it is, and what to do
 * @property {() => [string, string][]} numbers of the picture that is open
 * @property {() => boolean} done whether there is anything to see
 * @property {string} more in the manual
 */

const KEPT = "touchline-tour";
const report = () => preview.value?.report ?? version.value?.report ?? null;
const figure = (/** @type {number | null | undefined} */ value) => `${mm(value)} mm`;

/** @type {Stop[]} */
export const STOPS = [
  {
    id: "camera",
    step: "",
    at: ".cards.cameras",
    title: "A camera",
    more: "live.md",
    done: () => snapshot.value !== null,
    text: "Each camera is shown live, with its state and its frames per second. Take a picture with one of them, or " +
      "open a file.",
    numbers: () =>
      cameras.value
        .slice(0, 3)
        .map(({ id, name }) => [name, statuses.value[id] ? `${number(statuses.value[id].fps)} fps` : "–"]),
  },
  {
    id: "picture",
    step: "field",
    at: "[data-testid=region]",
    title: "Which field, which part",
    more: "start.md",
    done: () => region.value !== null,
    text: "Millimetres come from the field's rules, so say which field it is and which part the camera sees. Its " +
      "borders are what you will click.",
    numbers: () => [
      ["Picture", snapshot.value ? `${snapshot.value.width} × ${snapshot.value.height} px` : "–"],
      ["Field", field.value?.title ?? "–"],
      [
        "Part",
        region.value ? `${number(region.value.width_mm, 0)} × ${number(region.value.height_mm, 0)} mm` : "–",
      ],
    ],
  },
  {
    id: "drawing",
    step: "field",
    at: "aside.left .field",
    title: "How the field stands in the picture",
    more: "conventions.md#the-field",
    done: () => region.value !== null,
    text: "L, R, T and B are left, right, top and bottom of the picture. Rotate the drawing until it stands as " +
      "the picture does.",
    numbers: () => [["Rotated by", `${rotation.value}°`]],
  },
  {
    id: "borders",
    step: "points",
    at: "[data-testid=borders]",
    title: "Click the borders",
    more: "borders.md",
    done: () => BORDERS.every((b) => pointsOf(doc.value, b).length >= POINTS_ADVISED),
    text: `Click along each border on the middle of its painted line: ${POINTS_ADVISED} points or more, from corner ` +
      `to corner. The loupe shows raw pixels; arrow keys move a point by 0.1 px.`,
    numbers: () => BORDERS.map((b) => [words(b), plural(pointsOf(doc.value, b).length, "point")]),
  },
  {
    id: "verdict",
    step: "points",
    at: "[data-testid=verdict]",
    title: "The verdict",
    more: "numbers.md#verdict",
    done: () => report() !== null,
    text: "One length first: how far off a place on the carpet may be. It follows every click. Up to 5 mm is good, " +
      "up to 15 mm fair.",
    numbers: () => [
      ["Verdict", figure(report()?.verdict.mm)],
      ["Held out", figure(report()?.cv_rms_mm)],
      ["Expected, carpet", figure(report()?.sigma_mm?.rms)],
    ],
  },
  {
    id: "warnings",
    step: "points",
    at: "section[aria-label=Verdict]",
    title: "What to mind",
    more: "warnings.md",
    done: () => report() !== null,
    text: "Warnings stand under the verdict, each with its cure. No warning does not mean no error: read what each " +
      "number cannot see.",
    numbers: () => [
      ["Warnings", String(report()?.warnings.length ?? "–")],
      ...(report()
        ?.warnings.slice(0, 1)
        .map((w) => /** @type {[string, string]} */ (["First", w.text])) ?? []),
    ],
  },
  {
    id: "distortion",
    step: "points",
    fold: "distortion",
    at: "section[aria-label=Distortion]",
    title: "How bent the picture is",
    more: "numbers.md#distortion",
    done: () => report() !== null,
    text: "How far each border bows from the straight line between its ends. Negative is barrel, positive is " +
      "pincushion; a standard lens stays within ±3 %.",
    numbers: () =>
      BORDERS.map((b) => {
        const c = curves.value[b];
        return [words(b), isCurve(c) ? `${pct(c.distortion_pct)} %` : "–"];
      }),
  },
  {
    id: "residuals",
    step: "points",
    fold: "residuals",
    at: "section[aria-label=Residuals]",
    title: "How well you clicked",
    more: "numbers.md#residual",
    done: () => report() !== null,
    text: "Each bar is one point: how far it lies from its curve. About 0.3 px is a careful hand. A bar that stands " +
      "out is a slip: click on it to find the point.",
    numbers: () => [
      ["Residual", `${number(report()?.rms_px, 2)} px`],
      ["Worst", `${number(report()?.max_px, 2)} px`],
    ],
  },
  {
    id: "models",
    step: "points",
    fold: "lens",
    at: "[data-testid=models]",
    title: "Which model",
    more: "models.md",
    done: () => ranking.value !== null,
    text: "All models are fitted to the same points and listed by their error inside the field. The simplest " +
      "one among the best is recommended.",
    numbers: () =>
      ranking.value?.ranking.slice(0, 3).map((r) => [r.title, figure(r.field_mm)]) ?? [
        ["Chosen", model.value?.title ?? "–"],
      ],
  },
  {
    id: "save",
    step: "points",
    at: "[data-testid=next]",
    title: "Save a version",
    more: "keeping.md",
    done: () => isSaved.value,
    text: "The primary button always does the next thing. Here it keeps a version: the clicks, the model, the " +
      "picture and the report. Versions are never overwritten.",
    numbers: () => [["Version", version.value ? String(version.value.version) : "none yet"]],
  },
  {
    id: "compare",
    step: "verify",
    at: "[data-testid=stage]",
    title: "Raw beside corrected",
    more: "start.md",
    done: () => version.value !== null,
    text: "Drag the bar: what is bent on one side must be straight on the other. L lays the field's lines over " +
      "both; they must lie on the paint.",
    numbers: () => [
      ["Distortion before", `${pct(version.value?.report.distortion.before_pct)} %`],
      ["after", `${pct(version.value?.report.distortion.after_pct)} %`],
    ],
  },
  {
    id: "map",
    step: "verify",
    at: ".tools [data-testid=do-heat]",
    title: "Where the error is",
    more: "numbers.md#expected-error",
    done: () => version.value !== null,
    text: "An error has a place. E lays the expected error over the picture and rings the worst place, on the " +
      "carpet or at the height of robots' hats.",
    numbers: () => [
      ["Carpet", figure(version.value?.report.sigma_mm?.rms)],
      ["worst", figure(version.value?.report.sigma_mm?.max)],
      ["Hats", figure(version.value?.report.sigma_mm?.hat?.rms)],
    ],
  },
  {
    id: "activate",
    step: "verify",
    at: "[data-testid=next]",
    title: "Use it",
    more: "keeping.md",
    done: () => version.value?.active ?? false,
    text: "Activate the version: from then on the live picture, REST and SSL-Vision use it. Going back is " +
      "activating an earlier one. The report and files for other programs are on the left.",
    numbers: () => [
      ["Camera", camera.value?.name ?? "a file: download it instead"],
      ["Active", version.value?.active ? `version ${version.value.version}` : "not yet"],
    ],
  },
];

/** Whether it is being taken, and where it stands; at stays when it is left. */
export const tour = signal(kept());
export const stop = computed(() => STOPS[tour.value.at]);

/** @returns {{ on: boolean, at: number }} */
function kept() {
  try {
    const { on, at } = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
    if (Number.isInteger(at) && at >= 0 && at < STOPS.length) return { on: on === true, at };
  } catch {
    /* somebody else's */
  }
  return { on: false, at: 0 };
}

effect(() => {
  const { on, at } = tour.value;
  try {
    localStorage.setItem(KEPT, JSON.stringify({ on, at }));
  } catch {
    /* private windows keep nothing */
  }
});

/** The cameras are not shown while a picture is open. */
export const firstStop = () => (snapshot.value ? 1 : 0);

/** Begin, or go on where it was left. */
export const takeTour = () => {
  tour.value = { on: true, at: Math.max(firstStop(), tour.value.at) };
};
export const leaveTour = () => {
  tour.value = { ...tour.value, on: false };
};

/** @param {number} by */
export function go(by) {
  const at = tour.value.at + by;
  tour.value = at >= STOPS.length ? { on: false, at: 0 } : { on: true, at: Math.max(firstStop(), at) };
}
