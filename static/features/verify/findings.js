// What each check of a version says: from the server's answer to a state, a title, a figure and a fix.
import { mm, number, plural, words } from "../../core/format.js";
import { addressOf } from "../../core/route.js";
import { models } from "../../core/state.js";
import { robotTopsMm } from "../calibrate/camera_height.js";
import { changesInWords } from "../versions/outdated.js";

/**
 * @typedef {import("./types").Check} Check
 * @typedef {import("../../core/types").Calibration} Calibration
 */

const LENS_SAME_PX = 2; // two fits of one lens to other points differ by about a pixel near the image's corners
const SAME_MM = 1; // less than what two calibrations from two images of one camera differ by
const AGREE_MM = 5; // as far as a good calibration may be off: app/evaluate/fit/report.py

const STATES = /** @type {const} */ ({ good: "ok", fair: "note", poor: "bad", unknown: "bad" });

/** A check with what is known of it. @param {Pick<Check, "id" | "state" | "title"> & Partial<Check>} known
 * @returns {Check} */
export const check = (known) => ({ value: "", text: "", fix: "", href: "", ...known });

/** Where points are added, and where the lens model is chosen. @param {Calibration} it */
const pointsAddress = (it) => (it.snapshot ? addressOf("calibrate", { picture: it.snapshot, step: "points" }) : "");
/** With the lens models unfolded. @param {Calibration} it */
const modelAddress = (it) => (it.snapshot ? `#/calibrate/${it.snapshot}/model` : "");

/** @param {Calibration} it @param {...string} reasons */
const warningOf = (it, ...reasons) => it.report.warnings.find((w) => reasons.includes(w.reason));

/** @param {Calibration} it @param {import("./types").LinesAnswer} answer */
export function linesFinding(it, { found_share, lines_found, missing, lines, verdict: { level, reason } }) {
  const length = `${lines_found} of ${plural(lines.length, "line")}, ${number(100 * found_share, 0)} % of their length`,
    farthest = lines.toSorted((a, b) => (b.worst_mm ?? 0) - (a.worst_mm ?? 0))[0],
    known = { id: "lines", text: `${length}.`, href: pointsAddress(it) };
  if (level === null)
    return check({ ...known, state: "unknown", title: "Too few field lines detected to judge", href: "" });
  if (reason === "elsewhere")
    return check({
      ...known,
      state: STATES[level],
      title: "The field lines are elsewhere in the image",
      fix: "Check the field type and the covered area.",
    });
  if (missing.length)
    return check({
      ...known,
      state: STATES[level],
      title: "Field lines not detected",
      text: `${length}. Not detected: ${missing.map((name) => words(name).toLowerCase()).join(", ")}.`,
      fix: "Add points on these lines, or check the field type.",
    });
  if (level === "good") return check({ ...known, state: "ok", title: "Field lines found", href: "" });
  const where = farthest ? ` Largest error: ${words(farthest.feature).toLowerCase()}.` : "";
  return check({
    ...known,
    state: STATES[level],
    title: level === "poor" ? "Field lines are misplaced" : "Field lines are slightly misplaced",
    value: farthest ? `${mm(farthest.worst_mm)} mm` : "",
    text: `${length}.${where}`,
    fix: "Add points on this line, or use another lens model.",
  });
}

/** Only where something is wrong. @param {Calibration} it */
export const fieldFinding = ({ field_changes: changes = [] }) =>
  changes.length
    ? [
        check({
          id: "field",
          state: "bad",
          title: "Field changed since",
          text: `Elsewhere now: ${changesInWords(changes)}.`,
          fix: "Save a new version.",
        }),
      ]
    : [];

const ACCURACY = {
  good: "Accurate enough for matches",
  fair: "Usable accuracy",
  poor: "Not accurate enough for matches",
  unknown: "Accuracy inside the field is unknown",
};

/** @param {Calibration} it */
export function accuracyFinding(it) {
  const { level } = it.report.verdict,
    hat = it.report.sigma_mm?.hat,
    tops = robotTopsMm(it.report),
    isBad = STATES[level] === "bad";
  return check({
    id: "accuracy",
    state: STATES[level],
    title: ACCURACY[level],
    value: level === "unknown" ? "?" : `${mm(it.report.verdict.mm)} mm`,
    text:
      hat && tops !== null
        ? `At robot tops (${number(hat.z_mm, 0)} mm): ${mm(tops)} mm.`
        : "At robot tops: unknown.",
    fix: isBad ? "Add points on lines inside the field, or use another lens model." : "",
    href: isBad ? pointsAddress(it) : "",
  });
}

/** @param {Calibration} it */
export function modelFinding(it) {
  const wrong = warningOf(it, "another-lens", "lens-ends"),
    value = models.value.find((m) => m.name === it.model.name)?.title ?? words(it.model.name);
  if (!wrong) return check({ id: "model", state: "ok", title: "Lens model fits the points", value });
  const title =
    wrong.reason === "lens-ends"
      ? "The lens model does not reach all of the field"
      : "Another lens model contradicts this one";
  return check({ id: "model", state: "bad", title, value, text: wrong.text, fix: wrong.fix, href: modelAddress(it) });
}

/** @param {Calibration} it */
export function heightFinding(it) {
  const { camera } = it.report,
    wrong = warningOf(it, "height-unknown", "implausible-camera"),
    measured = camera ? `${number(camera.height_mm / 1000, 1)} m, tilt ${number(camera.tilt_deg, 1)}°` : "";
  if (wrong) {
    const isKnownWell = ["good", "fair"].includes(it.report.verdict.level); // the error at robot tops is in that
    return check({
      id: "height",
      state: wrong.reason === "height-unknown" && isKnownWell ? "note" : "bad",
      title: wrong.reason === "height-unknown" ? "The camera height is unknown" : "The camera height is implausible",
      text: wrong.reason === "height-unknown" ? `Estimated from the points: ${measured}.` : wrong.text,
      fix: "Measure the camera height and enter it.",
      href: modelAddress(it),
    });
  }
  if (camera) return check({ id: "height", state: "ok", title: "Camera height is plausible", text: `${measured}.` });
  if (camera === null)
    return check({
      id: "height",
      state: "note",
      title: "This model has no camera height",
      text: "Positions at robot height are not corrected.",
    });
  return check({ id: "height", state: "unknown", title: "Camera height", text: "Not recorded in this version." });
}

/** @param {import("./types").Difference} difference @param {string} from the former version, in words */
export function lensFinding({ lens }, from) {
  if (!lens) return null;
  const pct = Math.max(0.01, Math.abs(100 * (lens.focal_ratio - 1))), // no figure is better than that
    text = `Focal length within ${number(pct, 2)} %.`;
  if (lens.max_px === null) return check({ id: "lens", state: "unknown", title: "Lens", text });
  const isSame = lens.max_px <= LENS_SAME_PX;
  return check({
    id: "lens",
    state: isSame ? "ok" : "note",
    title: isSame ? `Lens unchanged since ${from}` : `Lens differs from ${from}`,
    value: `${number(Math.max(0.1, lens.max_px), 1)} px`,
    text,
  });
}

/** @param {import("./types").Difference} difference @param {string} from */
export function differenceFinding({ median_mm, max_mm }, from) {
  const id = "difference";
  if (median_mm === null || max_mm === null)
    return check({ id, state: "unknown", title: `Difference from ${from}`, text: "They have no place in common." });
  const isSame = max_mm <= SAME_MM;
  return check({
    id,
    state: isSame ? "ok" : "note",
    title: isSame ? `Same positions as ${from}` : `Differs from ${from}`,
    value: `${mm(median_mm)} mm`,
    text: `Median; ${mm(max_mm)} mm at the worst place.`,
  });
}

/** @param {string} id @param {string} name of the neighbour
 * @param {import("../pair/types").PairAnswer["agreement"]} agreement */
export function neighbourFinding(id, name, agreement) {
  if (!agreement) return null;
  const { median_mm, overlap_m2, verdict } = agreement,
    state = STATES[verdict.level];
  const isNear = median_mm <= AGREE_MM,
    agrees = isNear ? `Agrees with ${name}` : `Does not agree with ${name}`;
  return check({
    id,
    state,
    title: state === "bad" && isNear ? `Agreement with ${name} is not reliable` : agrees,
    value: `${mm(median_mm)} mm`,
    text:
      state === "bad" && isNear
        ? "One of the two versions is not accurate enough for matches."
        : `On ${number(overlap_m2, 0)} m² that both cameras cover.`,
    fix: state === "bad" ? "Compare the two cameras, and calibrate the less accurate one again." : "",
    href: state === "bad" ? addressOf("pair") : "",
  });
}

/** @param {import("../../core/types").Format | undefined} format @param {number} limit_mm */
export function exportFinding(format, limit_mm) {
  if (!format) return null;
  const id = "export",
    title = "SSL-Vision export",
    { problem, loss } = format;
  if (problem) return check({ id, title, state: "note", text: problem.what, fix: problem.fix });
  if (!loss) return check({ id, title, state: "ok", value: "0 mm", text: "Exact." });
  const worst = Math.max(loss.worst_mm, loss.hat_worst_mm ?? 0);
  if (worst > limit_mm)
    return check({
      id,
      title,
      state: "note",
      value: `${mm(worst)} mm`,
      text: `Above the limit for publishing, ${mm(limit_mm)} mm. Use the SSL lens model to publish this camera.`,
    });
  return check({ id, title, state: "ok", value: `${mm(worst)} mm`, text: "One-parameter lens, at the worst place." });
}
