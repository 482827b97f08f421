// The operator's document: its points in one order, its options with another model, its form on the server.
import assert from "node:assert/strict";
import test from "node:test";
import {
  EMPTY,
  fromDraft,
  pointsOf,
  withAutomaticModel,
  withModel,
  withPoints,
} from "../../static/core/document.js";

const option = (name, type = "number") => ({ name, type, default: null });

test("the same clicks make the same document in whichever order they were made", () => {
  const order = ["halfway-line", "bottom", "left", "top", "right"];
  const made = (features) =>
    features.reduce((doc, name) => withPoints(doc, name, [[1, 2]], "line"), EMPTY);
  assert.deepEqual(
    made(order).observations.map((o) => o.feature),
    ["left", "right", "top", "bottom", "halfway-line"],
  );
  assert.equal(JSON.stringify(made(order)), JSON.stringify(made(order.toReversed())));
});

test("a line that has lost its last point is no longer in the document", () => {
  const doc = withPoints(EMPTY, "left", [[1, 2]], "line");
  assert.deepEqual(pointsOf(doc, "left"), [[1, 2]]);
  assert.deepEqual(withPoints(doc, "left", [], "line"), EMPTY);
  assert.deepEqual(pointsOf(EMPTY, "left"), []);
});

test("another model keeps the options that mean the same to both, and no lens", () => {
  const before = {
    name: "brown-conrady",
    options: [
      option("height_mm"),
      option("terms"),
      option("lens", "calibration"),
      option("lens_sigma", "choice"),
    ],
  };
  const next = {
    ...before,
    name: "fisheye",
    options: before.options.filter((o) => o.name !== "terms"),
  };
  const doc = {
    ...EMPTY,
    model: before.name,
    options: { height_mm: 3000, terms: ["k1"], lens: "abc", lens_sigma: "0" },
  };
  assert.deepEqual(withModel(doc, next, before), {
    ...doc,
    model: "fisheye",
    options: { height_mm: 3000 },
  });
  const other = { ...next, options: [{ ...option("height_mm"), default: 1 }] }; // the same name of something else
  assert.deepEqual(withModel(doc, other, before).options, {});
  assert.deepEqual(withModel(doc, next, null).options, {});
});

test("the automatic model keeps what is true of the camera whichever model describes it", () => {
  const options = {
    height_mm: 3000,
    line_sigma_mm: 3,
    click_sigma_px: 1,
    n_rectangles_x: 9,
    terms: ["k1"],
    degree: 3,
  };
  assert.deepEqual(withAutomaticModel({ ...EMPTY, model: "division", options }), {
    ...EMPTY,
    model: null,
    options: {
      height_mm: 3000,
      line_sigma_mm: 3,
      click_sigma_px: 1,
      n_rectangles_x: 9,
    },
  });
});

test("an empty draft is an empty document, and a height of zero is none", () => {
  assert.deepEqual(fromDraft({ model: "" }), EMPTY);
  const on = { feature: "left", kind: "line", points: [[1, 2]] };
  assert.deepEqual(
    fromDraft({
      observations: [
        { ...on, z_mm: 0, extra: 1 },
        { ...on, z_mm: 150 },
      ],
    }).observations,
    [on, { ...on, z_mm: 150 }],
  );
});
