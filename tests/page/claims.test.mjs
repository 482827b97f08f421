// What the page makes of the server's claims: only what is held is ticked, and each fix leads to where it is done.
import assert from "node:assert/strict";
import { test } from "node:test";
import "./features.mjs";
import { toCheck } from "../../static/features/verify/claims.js";

const AT = { snapshot: "abc", camera: "north" };
const claim = (more = {}) => ({
  code: "lines",
  state: "held",
  gates: false,
  title: "Field lines detected",
  evidence: "8 of 9.",
  fix: "",
  tried: ["own-image"],
  figure: null,
  cure: "",
  camera: null,
  ...more,
});
const of = (more, at = AT) => toCheck(claim(more), at);

test("a claim is ticked only where it is held, and grey where it was not tested", () => {
  const marks = [
    ["held", true],
    ["held", false],
    ["refuted", true],
    ["refuted", false],
    ["not-tested", true],
    ["not-tested", false],
  ].map(([state, gates]) => of({ state, gates }));
  assert.deepEqual(
    marks.map((it) => it.state),
    ["ok", "ok", "bad", "note", "unknown", "unknown"],
  );
  assert.deepEqual(
    marks.map((it) => it.isProblem),
    [false, false, true, false, true, false],
  );
});

test("a figure is shown with its unit, and a bound as one", () => {
  const shown = (value, unit, at_most) => of({ figure: { value, unit, at_most } }).value;
  assert.deepEqual(
    [shown(0.31, "mm", false), shown(17.2, "mm", true), shown(0.44, "px", false), of().value],
    ["0.3 mm", "≤ 17 mm", "0.4 px", ""],
  );
});

test("each fix leads to where it is done, as far as there is such a place", () => {
  const leads = (cure, more = {}, at = AT) => of({ cure, ...more }, at).href;
  assert.equal(leads("points"), "#/calibrate/abc/points");
  assert.equal(leads("model"), "#/calibrate/abc/model");
  assert.deepEqual(
    ["points", "model"].map((cure) => leads(cure, {}, { snapshot: null })),
    ["", ""],
  );
  for (const cure of ["camera", "versions", "images", "drift"]) {
    assert.ok(leads(cure).includes("north"), cure);
    assert.ok(leads(cure, { camera: "east" }).includes("east"), cure); // a claim's own camera comes first
    assert.equal(leads(cure, {}, {}), "");
  }
  assert.ok(leads("rig", { code: "rig-hall" }).endsWith("/hall"));
  assert.ok(leads("publishing").startsWith("#/") && leads("pair").startsWith("#/"));
  assert.equal(leads(""), "");
});
