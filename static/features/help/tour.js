// The tour: one picture from camera to activation, explained with its own numbers.
import { computed, effect, signal } from "@preact/signals";
import { BORDERS, doc, pointsOf } from "../../core/document.js";
import { lineTitle, mm, number, pct } from "../../core/format.js";
import { camera, cameras, field, model, region, rotation, snapshot } from "../../core/state.js";
import { t } from "../../core/words.js";
import { robotTopsMm } from "../calibrate/camera_height.js";
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
    title: t("help.stop.camera.title"),
    more: "live.md",
    done: () => snapshot.value !== null,
    text: t("help.stop.camera.text"),
    numbers: () =>
      cameras.value
        .slice(0, 3)
        .map(({ id, name }) => [
          name,
          statuses.value[id]
            ? t("help.stop.camera.rate", { rate: number(statuses.value[id].fps) })
            : "–",
        ]),
  },
  {
    id: "picture",
    step: "field",
    at: "[data-testid=region]",
    title: t("help.stop.picture.title"),
    more: "calibrating.md",
    done: () => region.value !== null,
    text: t("help.stop.picture.text"),
    numbers: () => [
      [
        t("help.stop.picture.picture"),
        snapshot.value ? `${snapshot.value.width} × ${snapshot.value.height} px` : "–",
      ],
      [t("help.stop.picture.field"), field.value?.title ?? "–"],
      [
        t("help.stop.picture.part"),
        region.value
          ? `${number(region.value.width_mm, 0)} × ${number(region.value.height_mm, 0)} mm`
          : "–",
      ],
    ],
  },
  {
    id: "drawing",
    step: "field",
    at: "aside.right .field",
    title: t("help.stop.drawing.title"),
    more: "conventions.md#the-field",
    done: () => region.value !== null,
    text: t("help.stop.drawing.text"),
    numbers: () => [[t("help.stop.drawing.rotated"), `${rotation.value}°`]],
  },
  {
    id: "borders",
    step: "points",
    at: "[data-testid=borders]",
    title: t("help.stop.borders.title"),
    more: "points.md",
    done: () => BORDERS.every((b) => pointsOf(doc.value, b).length >= POINTS_ADVISED),
    text: t("help.stop.borders.text", { points: POINTS_ADVISED }),
    numbers: () =>
      BORDERS.map((b) => [
        lineTitle(b),
        t("common.points", { count: pointsOf(doc.value, b).length }),
      ]),
  },
  {
    id: "verdict",
    step: "points",
    at: "[data-testid=verdict]",
    title: t("help.stop.verdict.title"),
    more: "numbers.md#verdict",
    done: () => report() !== null,
    text: t("help.stop.verdict.text"),
    numbers: () => [
      [t("common.verdict"), figure(report()?.verdict.mm)],
      [t("help.stop.verdict.held-out"), figure(report()?.cv_rms_mm)],
      [t("help.stop.verdict.expected"), figure(report()?.sigma_mm?.rms)],
    ],
  },
  {
    id: "warnings",
    step: "points",
    at: "section:has([data-testid=explain-verdict])",
    title: t("help.stop.warnings.title"),
    more: "warnings.md",
    done: () => report() !== null,
    text: t("help.stop.warnings.text"),
    numbers: () => [
      [t("help.stop.warnings.warnings"), String(report()?.warnings.length ?? "–")],
      ...(report()
        ?.warnings.slice(0, 1)
        .map((w) => /** @type {[string, string]} */ ([t("help.stop.warnings.first"), w.text])) ??
        []),
    ],
  },
  {
    id: "distortion",
    step: "points",
    fold: "distortion",
    at: "section:has([data-testid=fold-distortion])",
    title: t("help.stop.distortion.title"),
    more: "numbers.md#distortion",
    done: () => report() !== null,
    text: t("help.stop.distortion.text"),
    numbers: () =>
      BORDERS.map((b) => {
        const c = curves.value[b];
        return [lineTitle(b), isCurve(c) ? `${pct(c.distortion_pct)} %` : "–"];
      }),
  },
  {
    id: "residuals",
    step: "points",
    fold: "residuals",
    at: "section:has([data-testid=fold-residuals])",
    title: t("help.stop.residuals.title"),
    more: "numbers.md#residual",
    done: () => report() !== null,
    text: t("help.stop.residuals.text"),
    numbers: () => [
      [t("help.stop.residuals.residual"), `${number(report()?.rms_px, 2)} px`],
      [t("help.stop.residuals.worst"), `${number(report()?.max_px, 2)} px`],
    ],
  },
  {
    id: "models",
    step: "points",
    fold: "lens",
    at: "[data-testid=models]",
    title: t("help.stop.models.title"),
    more: "models.md",
    done: () => ranking.value !== null,
    text: t("help.stop.models.text"),
    numbers: () =>
      ranking.value?.ranking.slice(0, 3).map((r) => [r.title, figure(r.field_mm)]) ?? [
        [t("help.stop.models.chosen"), model.value?.title ?? "–"],
      ],
  },
  {
    id: "save",
    step: "points",
    at: "[data-testid=next]",
    title: t("help.stop.save.title"),
    more: "saved-data.md",
    done: () => isSaved.value,
    text: t("help.stop.save.text"),
    numbers: () => [
      [
        t("help.stop.save.version"),
        version.value ? String(version.value.version) : t("help.stop.save.none"),
      ],
    ],
  },
  {
    id: "compare",
    step: "verify",
    at: "[data-testid=stage]",
    title: t("help.stop.compare.title"),
    more: "calibrating.md",
    done: () => version.value !== null,
    text: t("help.stop.compare.text"),
    numbers: () => [
      [t("help.stop.compare.before"), `${pct(version.value?.report.distortion.before_pct)} %`],
      [t("help.stop.compare.after"), `${pct(version.value?.report.distortion.after_pct)} %`],
    ],
  },
  {
    id: "map",
    step: "verify",
    at: ".tools [data-testid=do-heat]",
    title: t("help.stop.map.title"),
    more: "numbers.md#expected-error",
    done: () => version.value !== null,
    text: t("help.stop.map.text"),
    numbers: () => [
      [t("common.carpet"), figure(version.value?.report.sigma_mm?.rms)],
      [t("help.stop.map.worst"), figure(version.value?.report.sigma_mm?.max)],
      [t("common.hats"), figure(version.value && robotTopsMm(version.value.report))],
    ],
  },
  {
    id: "activate",
    step: "verify",
    at: "[data-testid=next]",
    title: t("help.stop.activate.title"),
    more: "saved-data.md",
    done: () => version.value?.active ?? false,
    text: t("help.stop.activate.text"),
    numbers: () => [
      [t("help.stop.activate.camera"), camera.value?.name ?? t("help.stop.activate.no-camera")],
      [
        t("common.active"),
        version.value?.active
          ? t("help.stop.activate.version", { version: version.value.version })
          : t("help.stop.activate.not-yet"),
      ],
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
  tour.value =
    at >= STOPS.length ? { on: false, at: 0 } : { on: true, at: Math.max(firstStop(), at) };
}
