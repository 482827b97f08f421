// What each check of a version says: its state, its figure, and where its fix is done.
import assert from "node:assert/strict";
import { test } from "node:test";
import { models } from "../../static/core/state.js";
import { t } from "../../static/core/words.js";
import * as findings from "../../static/features/verify/findings.js";

const POINTS = "#/calibrate/abc/points",
  MODELS = "#/calibrate/abc/model";

/** A version with a good report, changed as a test needs it. */
const version = (report = {}, more = {}) => ({ id: "v", snapshot: "abc", model: { name: "brown-conrady" },
  field_changes: [], ...more, report: { verdict: { level: "good", mm: 2.34 }, warnings: [],
    sigma_mm: { hat: { rms: 12.6, z_mm: 150, known: true } }, camera: { height_mm: 5040, tilt_deg: 6.25 }, ...report } });
const warning = (reason) => ({ reason, text: `${reason}.`, fix: "Mend it." });
const lines = (level, more = {}) => ({ found_share: 0.914, lines_found: 8, missing: [],
  lines: [{ feature: "left", worst_mm: 3 }, { feature: "halfway-line", worst_mm: 17.2 }, { feature: "top", worst_mm: null }],
  ...more, verdict: { lines_level: level, reason: "", fix: "Fit again.", ...more.verdict } });
const found = (level, more) => findings.linesFinding(version(), lines(level, more));

test("lines that are where they should be need no fix", () => {
  const is = found("good");
  assert.deepEqual([is.id, is.state, is.title, is.value, is.fix, is.href], ["lines", "ok", t("verify.lines.ok"), "", "", ""]);
  assert.equal(is.text, t("verify.lines.found", { found: 8, count: 3, share: "91" }));
});

test("misplaced lines name the farthest one and lead to the points", () => {
  const poor = found("poor"),
    fair = found("fair");
  assert.deepEqual([poor.state, poor.title, poor.value, poor.href], ["bad", t("verify.lines.misplaced"), "17 mm", POINTS]);
  assert.ok(poor.text.endsWith(t("verify.lines.largest-error", { line: "halfway line" })));
  assert.deepEqual([fair.state, fair.title, fair.fix], ["note", t("verify.lines.slightly-misplaced"),
    t("verify.lines.misplaced.fix")]);
});

test("missing lines are named, whatever the others are worth, and a fit that never fitted says its own fix", () => {
  const is = found("fair", { missing: ["left", "centre-circle"] });
  assert.deepEqual([is.state, is.title, is.fix], ["note", t("verify.lines.missing"), t("verify.lines.missing.fix")]);
  assert.ok(is.text.includes("left border, centre circle"));
  assert.equal(found("poor", { missing: ["left"], verdict: { reason: "never-right" } }).fix, "Fit again.");
  assert.equal(found("poor", { verdict: { reason: "never-right" } }).fix, "Fit again.");
  assert.equal(found("poor", { verdict: { reason: "elsewhere" }, missing: ["left"] }).title, t("verify.lines.elsewhere"));
});

test("too few lines tell nothing, and a version without an image leads nowhere", () => {
  assert.deepEqual([found(null).state, found(null).href], ["unknown", ""]);
  assert.equal(findings.linesFinding(version({}, { snapshot: null }), lines("poor")).href, "");
});

test("a changed field is a finding of its own, an unchanged one is none", () => {
  assert.deepEqual(findings.fieldFinding(version()), []);
  const [is] = findings.fieldFinding(version({}, { field_changes: ["its size", "centre-circle"] }));
  assert.equal(is.state, "bad");
  assert.ok(is.text.includes(t("versions.changes.size")) && is.text.includes("centre circle"));
});

test("the accuracy is bad where it is poor or not known, and its error at robot tops is told where that is known", () => {
  const of = (level, more) => findings.accuracyFinding(version({ verdict: { level, mm: 2.34 }, ...more }));
  assert.deepEqual(["good", "fair", "poor", "unknown"].map((level) => of(level).state), ["ok", "note", "bad", "bad"]);
  assert.deepEqual(["fair", "poor", "unknown"].map((level) => [of(level).value, of(level).href]),
    [["2.3 mm", ""], ["2.3 mm", POINTS], ["?", POINTS]]);
  assert.equal(of("good").text, t("verify.accuracy.robot-tops", { height: "150", error: "13" }));
  const unknown = t("verify.accuracy.robot-tops-unknown");
  for (const hat of [{ rms: 12, z_mm: 150, known: false }, null]) assert.equal(of("good", { sigma_mm: { hat } }).text, unknown);
  assert.equal(of("good", { sigma_mm: null }).text, unknown);
});

test("a model that the points contradict leads to the models", () => {
  models.value = [{ name: "brown-conrady", title: "Brown–Conrady", options: [] }];
  const of = (...reasons) => findings.modelFinding(version({ warnings: reasons.map(warning) }));
  assert.deepEqual([of().state, of().value, of("stray-click").state], ["ok", "Brown–Conrady", "ok"]);
  const is = of("stray-click", "lens-ends");
  assert.deepEqual([is.state, is.title, is.text, is.fix, is.href],
    ["bad", t("verify.model.ends"), "lens-ends.", "Mend it.", MODELS]);
  assert.equal(of("another-lens").title, t("verify.model.contradicted"));
});

test("a height that nobody knows is worth a note where the accuracy is known all the same", () => {
  const of = (report) => findings.heightFinding(version(report));
  const unknown = { warnings: [warning("height-unknown")] };
  assert.equal(of({}).text, `${t("verify.height.measured", { height: "5.0", tilt: "6.3" })}.`);
  assert.deepEqual([of(unknown).state, of(unknown).href], ["note", MODELS]);
  assert.equal(of({ ...unknown, verdict: { level: "poor", mm: 90 } }).state, "bad");
  const odd = of({ warnings: [warning("implausible-camera")] });
  assert.deepEqual([odd.state, odd.text], ["bad", "implausible-camera."]);
  assert.deepEqual([of({ camera: null }).state, of({ camera: undefined }).state], ["note", "unknown"]);
});

test("two fits of one lens are the same within two pixels, and no lens is no finding", () => {
  const of = (max_px, focal_ratio = 1.0004) => findings.lensFinding({ lens: { max_px, focal_ratio } }, "version 1");
  assert.equal(findings.lensFinding({ lens: null }, "version 1"), null);
  assert.deepEqual([0.02, 2, 2.1].map((px) => [of(px).state, of(px).value]),
    [["ok", "0.1 px"], ["ok", "2.0 px"], ["note", "2.1 px"]]);
  assert.equal(of(3, 0.98).text, t("verify.lens.focal-length", { share: "2.00" }));
  assert.equal(of(3, 1).text, t("verify.lens.focal-length", { share: "0.01" }));
  assert.deepEqual([of(null).state, of(null).value], ["unknown", ""]);
});

test("positions are the same within a millimetre of the version before", () => {
  const of = (median_mm, max_mm) => findings.differenceFinding({ median_mm, max_mm }, "version 1");
  assert.deepEqual([of(0.4, 1).state, of(4, 12).state, of(null, null).state], ["ok", "note", "unknown"]);
  assert.deepEqual([of(4, 12.4).value, of(4, 12.4).text], ["4.0 mm", t("verify.difference.worst", { worst: "12" })]);
});

test("a neighbour disagrees, or agrees and yet is too inaccurate to tell", () => {
  const of = (level, median_mm) =>
    findings.neighbourFinding("neighbour-east", "East", { median_mm, overlap_m2: 3.4, verdict: { level } });
  assert.equal(findings.neighbourFinding("neighbour-east", "East", null), null);
  const [agrees, disagrees, unreliable] = [of("good", 3), of("poor", 40), of("poor", 3)];
  assert.deepEqual([agrees, disagrees, unreliable].map((is) => [is.state, is.title, is.href]), [
    ["ok", t("verify.neighbour.agrees", { camera: "East" }), ""],
    ["bad", t("verify.neighbour.disagrees", { camera: "East" }), "#/field/pairs"],
    ["bad", t("verify.neighbour.unreliable", { camera: "East" }), "#/field/pairs"]]);
  assert.equal(agrees.text, t("verify.neighbour.overlap", { area: "3" }));
});

test("a packet is no better than what teams can make of it, and its warnings are told", () => {
  const of = (more) => findings.packetFinding({ expected: { rms: 3.21, hat: { rms: 14, z_mm: 150, known: true } },
    loss: { worst_mm: 0.4 }, level: "good", asked: false, warnings: [], problem: null, ...more });
  assert.deepEqual([of().state, of().value, of().text],
    ["ok", "3.2 mm", t("verify.packet.tops", { height: "150", error: "14" })]);
  assert.deepEqual([of({ level: "fair" }).state, of({ warnings: [warning("packet-error")] }).state,
    of({ warnings: [warning("rounded")] }).state], ["note", "ok", "note"]);
  const unknown = of({ expected: null, asked: true });
  assert.deepEqual([unknown.value, unknown.text], ["≤ 0.4 mm", `${t("verify.packet.unknown")} ${t("verify.packet.asked")}`]);
  assert.equal(of({ loss: null, expected: null }).value, "≤ – mm");
  const refused = of({ problem: { what: "No lens.", fix: "Choose one." } });
  assert.deepEqual([refused.state, refused.text, refused.fix], ["note", "No lens.", "Choose one."]);
});
