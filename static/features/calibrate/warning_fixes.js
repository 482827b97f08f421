// The buttons that fix a warning or a refusal, by its code.
import { mainViewport } from "../../canvas/viewport.js";
import { run } from "../../core/actions.js";
import { BORDERS, doc, pointsOf } from "../../core/document.js";
import { lensOpen, unfold } from "../../core/folds.js";
import { areaTitle, lineName } from "../../core/format.js";
import { go, goToStep } from "../../core/route.js";
import {
  camera,
  cameras,
  field,
  model,
  modelName,
  models,
  region,
  step,
} from "../../core/state.js";
import { t } from "../../core/words.js";
import { chooseArea, otherAreas } from "../automatic/find_lines.js";
import {
  activeViewport,
  correctedPlacement,
  margin,
  visiblePicture,
} from "../compare/comparison.js";
import { heat, shownMap } from "../compare/heat.js";
import { version } from "../versions/versions.js";
import { activateFeature, remove, select } from "./editing.js";
import { preview, stale } from "./fitting.js";
import { compareModels, ranking, useModel } from "./model_ranking.js";

/**
 * @typedef {{ reason?: string, feature?: string | null, index?: number | null }} Trouble
 * @typedef {{ label: string, test: string, run: () => void, waits?: boolean }} Fix
 */

const NEAREST = 2; // stage pixels for one of the picture, at least: a place can be seen well

/** @type {Record<string, (trouble: Trouble) => (Fix | null)[]>} */
export const FIXES = {
  "area-not-in-image": () => otherAreas.value.map(useArea),
  "stray-click": (trouble) => point(trouble),
  "border-extrapolated": ({ feature }) => [click(feature)],
  "inside-not-checked": () => [click(insideLine())],
  "model-removed": () => [recommended()],
  "height-unknown": () => [enterHeight(), board()],
  "height-contradicted": () => [enterHeight(), checkField()],
  "residuals-too-large": () => [checkField(), options()],
  "misplaced-lines": () => [checkField()],
  "unusual-height": () => [checkField(), enterHeight()],
  "unusual-focal-length": () => [checkField(), board()],
  "unusual-principal-point": () => [options()],
  "unusual-aspect": () => [checkField(), options()],
  "weakly-determined": () => [nextClick(), enterHeight(), board()],
  "above-the-carpet": () => [recommended()],
  "another-lens": () => [recommended()],
  "lens-ends": () => [recommended(), nextClick()],
  "too-few-points": ({ feature }) => [click(feature ?? fewest()), checkField()], // its line may not be in the image
  "collinear-points": ({ feature }) => [click(feature ?? fewest()), checkField()],
  "lines-not-enough": () => [click(fewest()), checkField()],
  "borders-cross": ({ feature }) => [click(feature ?? fewest()), checkField()],
  "outside-picture": (trouble) => point(trouble),
  "borders-swapped": () => [turn()],
  "bad-order": () => [turn()],
  mirrored: () => [picture()], // no rotation helps: the image is flipped where it comes from
  "no-camera": () => [recommended(), turn()],
  "implausible-camera": () => [recommended(), enterHeight()],
  folds: () => [recommended()],
  "bad-option": () => [options()],
  "unknown-option": () => [options()],
  "bad-corrected-size": () => [options()],
  "lens-sigma-unknown": () => [options()],
  "no-covariance": () => [recommended()],
  "size-mismatch": () => [picture()],
  imported: () => [picture()],
  // of a detection
  "no-lines": () => [picture(), click(fewest())],
  "no-markings": () => [click(fewest()), checkField()],
  "no-match": () => [checkField(), click(fewest())],
  "lines-missing": () => [checkField(), picture()],
  "lines-unexplained": () => [checkField()],
  ambiguous: () => [checkField(), enterHeight()],
  "too-few-lines": () => [click(insideLine() ?? fewest()), picture()],
  loose: () => [checkField(), recommended()],
  "series-moved": () => [picture()],
  "other-height": () => [enterHeight(), checkField()],
  "several-choices": () => [checkField()],
  "painted-elsewhere": () => [editField(), checkField()],
  "no-known-field": () => [checkField(), click(fewest()), newField()],
};

/** What can be done about it by a button. @param {Trouble} trouble @returns {Fix[]} */
export const fixesOf = (trouble) =>
  (FIXES[trouble.reason ?? ""]?.(trouble) ?? []).filter((fix) => fix !== null);

/** @param {string | null | undefined} feature @returns {Fix | null} */
const click = (feature) =>
  feature
    ? {
        label: t("calibrate.click", { feature: lineName(feature) }),
        test: "cure-click",
        run: () => clickOn(feature),
      }
    : null;

/** To where it can be clicked. @param {string} feature */
function clickOn(feature) {
  showPoints();
  activateFeature(feature);
}

/** One point: away with it, or a look at it. @param {Trouble} trouble @returns {(Fix | null)[]} */
function point({ feature, index }) {
  if (
    !feature ||
    index === null ||
    index === undefined ||
    index >= pointsOf(doc.value, feature).length
  )
    return [click(feature)];
  const pick = [{ feature, index }];
  return [
    {
      label: t("calibrate.warning-fixes.remove-point"),
      test: "remove-stray",
      waits: stale.value, // until the points that it speaks of are those in the picture
      run: () => {
        showPoints();
        remove(pick);
      },
    },
    {
      label: t("common.show-it"),
      test: "show-stray",
      run: () => {
        showPoints();
        select(pick);
      },
    },
  ];
}

/** To where points are seen. */
function showPoints() {
  goToStep("points");
}

/** To the lens models and their options. */
function openLens() {
  goToStep("points");
  unfold("lens");
}

/** The border with the fewest points. */
const fewest = () =>
  BORDERS.toSorted((a, b) => pointsOf(doc.value, a).length - pointsOf(doc.value, b).length)[0];

/** A line or arc inside that is in view and has no click yet; a circle tells most. */
function insideLine() {
  const f = field.value,
    r = region.value;
  if (!f || !r) return null;
  const isIn = (/** @type {import("../../core/types").Point} */ [x, y]) =>
    x > r.x[0] && x < r.x[1] && y > r.y[0] && y < r.y[1];
  const free = (/** @type {string} */ name) => pointsOf(doc.value, name).length === 0;
  return (
    f.arcs.find((a) => free(a.name) && a.centre[0] >= r.x[0] && a.centre[0] <= r.x[1])?.name ??
    f.lines.find(
      (l) => free(l.name) && isIn([(l.from[0] + l.to[0]) / 2, (l.from[1] + l.to[1]) / 2]),
    )?.name ??
    Object.entries(f.landmarks).find(([name, spot]) => free(name) && isIn(spot))?.[0] ??
    null
  );
}

/** @returns {Fix | null} */
const enterHeight = () =>
  model.value?.options.some((o) => o.name === "height_mm")
    ? {
        label: t("calibrate.warning-fixes.enter-height"),
        test: "enter-height",
        run: () => void toOption("height_mm"),
      }
    : null;

/** To the field where the fix goes. @param {string} name */
async function toOption(name) {
  showPoints();
  await new Promise(requestAnimationFrame); // once it is drawn
  if (!document.getElementById(`option-${name}`)) {
    openLens();
    await new Promise(requestAnimationFrame);
  }
  const input = document.getElementById(`option-${name}`);
  input?.scrollIntoView({ block: "center" });
  input?.focus();
}

/** @returns {Fix} */
const options = () => ({
  label: t("calibrate.warning-fixes.options"),
  test: "cure-options",
  run: () => void toOption(model.value?.options[0]?.name ?? ""),
});
/** @param {import("../../core/types").SeenArea} area @returns {Fix} */
const useArea = (area) => ({
  label: areaTitle(area.region),
  test: `cure-area-${area.region}`,
  run: () => {
    showPoints();
    chooseArea(area);
  },
});
/** @returns {Fix | null} */
const board = () =>
  model.value?.options.some((o) => o.type === "calibration")
    ? { label: t("calibrate.warning-fixes.board"), test: "cure-board", run: () => run("board") }
    : null;
/** @returns {Fix | null} */
const checkField = () =>
  step.value === "field"
    ? null
    : {
        label: t("calibrate.warning-fixes.check-field"),
        test: "cure-field",
        run: () => goToStep("field"),
      };
/** @returns {Fix | null} */
const editField = () =>
  field.value && {
    label: field.value.own ? t("calibrate.picture.edit") : t("calibrate.picture.edit-copy"),
    test: "cure-edit-field",
    run: () => go(field.value?.own ? "field-editor" : "new-field", { field: field.value?.name }),
  };
/** @returns {Fix} */
const newField = () => ({
  label: t("field-editor.action.new-field.short"),
  test: "cure-new-field",
  run: () => run("new-field"),
});
/** @returns {Fix | null} */
const turn = () =>
  region.value
    ? {
        label: t("calibrate.rotate-field"),
        test: "cure-turn",
        run: () => {
          showPoints();
          run("turn");
        },
      }
    : null;
/** Another picture: of the camera, where there is one. @returns {Fix} */
const picture = () =>
  (camera.value ?? cameras.value[0])
    ? { label: t("calibrate.take-picture"), test: "cure-picture", run: () => run("take") }
    : { label: t("calibrate.picture-actions.open"), test: "cure-picture", run: () => run("open") };

/** The model that is recommended, once they were compared. @returns {Fix | null} */
function recommended() {
  const name = ranking.value?.recommended,
    it = models.value.find((m) => m.name === name);
  if (it && name && name !== modelName.value)
    return {
      label: t("calibrate.warning-fixes.use-model", { model: it.title }),
      test: "cure-model",
      run: () => {
        openLens();
        useModel(name);
      },
    };
  return { label: t("calibrate.compare-models"), test: "cure-compare", run: goToModelComparison };
}

/** To the models; they are compared by themselves when one comes there. */
export function goToModelComparison() {
  if (step.value === "points" && lensOpen.value) compareModels();
  else openLens();
}

/** The report whose figures are in sight. */
const report = () =>
  activeViewport.value === mainViewport && step.value === "verify"
    ? version.value?.report
    : preview.value?.report;

/** Where one more click helps the worst place most. @returns {Fix | null} */
export function nextClick() {
  const next = report()?.next_click;
  if (!next) return null;
  return {
    label: t("calibrate.warning-fixes.click-there", { feature: lineName(next.feature) }),
    test: "cure-next-click",
    run: () => goTo(next),
  };
}

/** @param {{ feature: string, point: import("../../core/types").Point }} next */
function goTo({ feature, point: [x, y] }) {
  clickOn(feature);
  mainViewport.centre(x, y, NEAREST);
}

/** The same as a deed of its own. */
export function goToNextClick() {
  nextClick()?.run();
}

/** Bring the worst place of the map into the middle of the stage. */
export function centreWorstPlace() {
  const worst = shownMap.value?.at.image.at(-1) ?? null,
    corrected = shownMap.value?.at.corrected.at(-1) ?? null,
    here = correctedPlacement.value;
  if (visiblePicture.value === "corrected" && corrected && here)
    mainViewport.centre(
      here.x + here.scale * (corrected[0] + margin.value),
      here.y + here.scale * (corrected[1] + margin.value),
      NEAREST,
    );
  else if (worst) mainViewport.centre(worst[0], worst[1], NEAREST);
}

/** What to do about the worst place of the map: the strongest fix first. @returns {{ text: string, fixes: Fix[] }} */
export function worstPlaceFix() {
  const it = report(),
    map = shownMap.value;
  if (!it || !map || map.what !== "expected") return { text: "", fixes: [] };
  const height = it.warnings.find((w) => w.reason === "height-unknown"),
    next = it.next_click;
  if (heat.value.atHats && height) return { text: height.fix, fixes: fixesOf(height) };
  if (
    next &&
    next.worst_mm_then < next.worst_mm &&
    next.worst_mm_then.toFixed(1) !== next.worst_mm.toFixed(1)
  ) {
    return {
      text: t(
        next.z_mm
          ? "calibrate.warning-fixes.one-more-click-hats"
          : "calibrate.warning-fixes.one-more-click",
        {
          feature: lineName(next.feature),
          worst: next.worst_mm.toFixed(1),
          worstThen: next.worst_mm_then.toFixed(1),
        },
      ),
      fixes: [nextClick()].filter((c) => c !== null),
    };
  }
  return {
    text: t("calibrate.warning-fixes.more-clicks"),
    fixes: [click(fewest()), board()].filter((c) => c !== null),
  };
}
