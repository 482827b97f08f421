// What each check of a version says: from the server's answer to a state, a title, a figure and a fix.
import { lineName, mm, number } from "../../core/format.js";
import { addressOf } from "../../core/route.js";
import { modelTitle } from "../../core/state.js";
import { t } from "../../core/words.js";
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

/** @param {Calibration} it @param {import("./types").CalibrationCheck} answer */
export function linesFinding(it, { found_share, lines_found, missing, lines, verdict }) {
  const length = t("verify.lines.found", {
      found: lines_found,
      count: lines.length,
      share: number(100 * found_share, 0),
    }),
    // what its report says of itself is a finding of its own
    { lines_level: level, reason } = verdict,
    neverRight = reason === "never-right" && verdict.fix,
    farthest = lines.toSorted((a, b) => (b.worst_mm ?? 0) - (a.worst_mm ?? 0))[0],
    known = { id: "lines", text: length, href: pointsAddress(it) };
  if (level === null)
    return check({ ...known, state: "unknown", title: t("verify.lines.too-few"), href: "" });
  if (reason === "elsewhere")
    return check({
      ...known,
      state: STATES[level],
      title: t("verify.lines.elsewhere"),
      fix: t("verify.lines.elsewhere.fix"),
    });
  if (missing.length)
    return check({
      ...known,
      state: STATES[level],
      title: t("verify.lines.missing"),
      text: `${length} ${t("verify.lines.not-detected", {
        lines: missing.map((name) => lineName(name)).join(", "),
      })}`,
      fix: neverRight || t("verify.lines.missing.fix"),
    });
  if (level === "good") return check({ ...known, state: "ok", title: t("verify.lines.ok"), href: "" });
  const where = farthest
    ? ` ${t("verify.lines.largest-error", { line: lineName(farthest.feature) })}`
    : "";
  return check({
    ...known,
    state: STATES[level],
    title: level === "poor" ? t("verify.lines.misplaced") : t("verify.lines.slightly-misplaced"),
    value: farthest ? `${mm(farthest.worst_mm)} mm` : "",
    text: `${length}${where}`,
    fix: neverRight || t("verify.lines.misplaced.fix"),
  });
}

/** Only where something is wrong. @param {Calibration} it */
export const fieldFinding = ({ field_changes: changes = [] }) =>
  changes.length
    ? [
        check({
          id: "field",
          state: "bad",
          title: t("common.field-changed"),
          text: t("verify.field.elsewhere-now", { changes: changesInWords(changes) }),
          fix: t("verify.field.fix"),
        }),
      ]
    : [];

const ACCURACY = {
  good: t("verify.accuracy.good"),
  fair: t("verify.accuracy.fair"),
  poor: t("verify.accuracy.poor"),
  unknown: t("verify.accuracy.unknown"),
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
        ? t("verify.accuracy.robot-tops", { height: number(hat.z_mm, 0), error: mm(tops) })
        : t("verify.accuracy.robot-tops-unknown"),
    fix: isBad ? t("verify.accuracy.fix") : "",
    href: isBad ? pointsAddress(it) : "",
  });
}

/** @param {Calibration} it */
export function modelFinding(it) {
  const wrong = warningOf(it, "another-lens", "lens-ends"),
    value = modelTitle(it.model.name);
  if (!wrong) return check({ id: "model", state: "ok", title: t("verify.model.ok"), value });
  const title =
    wrong.reason === "lens-ends"
      ? t("verify.model.ends")
      : t("verify.model.contradicted");
  return check({ id: "model", state: "bad", title, value, text: wrong.text, fix: wrong.fix, href: modelAddress(it) });
}

/** @param {Calibration} it */
export function heightFinding(it) {
  const { camera } = it.report,
    wrong = warningOf(it, "height-unknown", "implausible-camera"),
    measured = camera
      ? t("verify.height.measured", { height: number(camera.height_mm / 1000, 1), tilt: number(camera.tilt_deg, 1) })
      : "";
  if (wrong) {
    const isKnownWell = ["good", "fair"].includes(it.report.verdict.level); // the error at robot tops is in that
    return check({
      id: "height",
      state: wrong.reason === "height-unknown" && isKnownWell ? "note" : "bad",
      title: wrong.reason === "height-unknown" ? t("verify.height.unknown") : t("verify.height.implausible"),
      text: wrong.reason === "height-unknown" ? t("verify.height.estimated", { measured }) : wrong.text,
      fix: t("verify.height.fix"),
      href: modelAddress(it),
    });
  }
  if (camera) return check({ id: "height", state: "ok", title: t("verify.height.ok"), text: `${measured}.` });
  if (camera === null)
    return check({
      id: "height",
      state: "note",
      title: t("verify.height.none"),
      text: t("verify.height.none.text"),
    });
  return check({ id: "height", state: "unknown", title: t("verify.height"), text: t("verify.height.not-recorded") });
}

/** @param {import("./types").Difference} difference @param {string} from the former version, in words */
export function lensFinding({ lens }, from) {
  if (!lens) return null;
  const pct = Math.max(0.01, Math.abs(100 * (lens.focal_ratio - 1))), // no figure is better than that
    text = t("verify.lens.focal-length", { share: number(pct, 2) });
  if (lens.max_px === null) return check({ id: "lens", state: "unknown", title: t("verify.lens"), text });
  const isSame = lens.max_px <= LENS_SAME_PX;
  return check({
    id: "lens",
    state: isSame ? "ok" : "note",
    title: isSame ? t("verify.lens.same", { former: from }) : t("verify.lens.differs", { former: from }),
    value: `${number(Math.max(0.1, lens.max_px), 1)} px`,
    text,
  });
}

/** @param {import("./types").Difference} difference @param {string} from */
export function differenceFinding({ median_mm, max_mm }, from) {
  const id = "difference";
  if (median_mm === null || max_mm === null)
    return check({
      id,
      state: "unknown",
      title: t("verify.difference", { former: from }),
      text: t("verify.difference.nothing-common"),
    });
  const isSame = max_mm <= SAME_MM;
  return check({
    id,
    state: isSame ? "ok" : "note",
    title: isSame ? t("verify.difference.same", { former: from }) : t("verify.difference.differs", { former: from }),
    value: `${mm(median_mm)} mm`,
    text: t("verify.difference.worst", { worst: mm(max_mm) }),
  });
}

/** @param {string} id @param {string} name of the neighbour
 * @param {import("../pair/types").PairAnswer["agreement"]} agreement */
export function neighbourFinding(id, name, agreement) {
  if (!agreement) return null;
  const { median_mm, overlap_m2, verdict } = agreement,
    state = STATES[verdict.level];
  const isNear = median_mm <= AGREE_MM,
    agrees = isNear
      ? t("verify.neighbour.agrees", { camera: name })
      : t("verify.neighbour.disagrees", { camera: name });
  return check({
    id,
    state,
    title: state === "bad" && isNear ? t("verify.neighbour.unreliable", { camera: name }) : agrees,
    value: `${mm(median_mm)} mm`,
    text:
      state === "bad" && isNear
        ? t("verify.neighbour.inaccurate")
        : t("verify.neighbour.overlap", { area: number(overlap_m2, 0) }),
    fix: state === "bad" ? t("verify.neighbour.fix") : "",
    href: state === "bad" ? addressOf("pair") : "",
  });
}

/** What teams receive. @param {import("../network/types").Packet} answer */
export function packetFinding({ expected, loss, level, asked, warnings, problem }) {
  const id = "packet",
    title = t("verify.packet");
  if (problem) return check({ id, title, state: "note", text: problem.what, fix: problem.fix });
  const told = warnings.filter((w) => w.reason !== "packet-error").map((w) => w.text),
    text = [asked ? t("verify.packet.asked") : "", topsInWords(expected?.hat ?? null), ...told].filter(Boolean);
  return check({
    id,
    title,
    state: level === "good" && !told.length ? "ok" : "note",
    value: expected ? `${mm(expected.rms)} mm` : `≤ ${mm(loss ? loss.worst_mm : null)} mm`,
    text: expected ? text.join(" ") : [t("verify.packet.unknown"), ...text].join(" "),
  });
}

/** @param {import("../network/types").ExpectedError["hat"] | null} hat */
const topsInWords = (hat) =>
  hat
    ? hat.known === false
      ? t("verify.packet.tops-unknown")
      : t("verify.packet.tops", { height: number(hat.z_mm, 0), error: mm(hat.rms) })
    : "";
