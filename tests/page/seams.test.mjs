// What two cameras of a rig share, and what a field is drawn as.
import assert from "node:assert/strict";
import { test } from "node:test";
import { goTo } from "./window.mjs";
import "./features.mjs";
import { rigCheck, rigs } from "../../static/features/rigs/rig.js";
import { seams, sharedArea } from "../../static/features/rigs/seams.js";
import { frameOf, middleOf, outline, placeIn } from "../../static/ui/field_plan.js";

const span = (x0, x1, y0, y1) => ({ x: [x0, x1], y: [y0, y1] });
const LEFT = span(-4500, 0, -3000, 3000),
  RIGHT = span(0, 4500, -3000, 3000);
const QUARTERS = [
  span(-4500, 0, 0, 3000),
  span(0, 4500, 0, 3000),
  span(-4500, 0, -3000, 0),
  span(0, 4500, -3000, 0),
];

test("two halves share the edge between them, two that overlap what both cover", () => {
  assert.deepEqual(sharedArea(LEFT, RIGHT), span(0, 0, -3000, 3000));
  assert.deepEqual(sharedArea(RIGHT, LEFT), span(0, 0, -3000, 3000));
  assert.deepEqual(sharedArea(RIGHT, span(-1000, 1000, 0, 3000)), span(0, 1000, 0, 3000));
});

test("a narrow gap is a seam, too; a wide one, and a corner, are none", () => {
  const beyond = (gap) => span(gap, 4500, -3000, 3000);
  assert.deepEqual(sharedArea(LEFT, beyond(200)), span(0, 200, -3000, 3000));
  assert.equal(sharedArea(LEFT, beyond(400)), null);
  const [topLeft, topRight, bottomLeft, bottomRight] = QUARTERS;
  assert.equal(sharedArea(topLeft, bottomRight), null);
  assert.equal(sharedArea(topRight, bottomLeft), null);
  assert.deepEqual(middleOf(sharedArea(topLeft, topRight)), [0, 1500]);
});

test("a seam has the figures of the newest check, that of this page first, or why there are none", () => {
  const camera = (id, area, calibration) => ({
      camera: id,
      title: id,
      area,
      calibration,
      troubles: [],
    }),
    pair = { a: "l", b: "r", level: "fair", median_mm: 4, max_mm: 9 };
  const now = (checked, calibration = "c") => {
    rigs.value = [
      { name: "hall", cameras: [camera("l", LEFT, "c"), camera("r", RIGHT, calibration)], checked },
    ];
    return seams.value.map(({ figures }) => figures);
  };
  goTo("#/field/rigs/hall");
  assert.deepEqual(now(null, null), []);
  assert.deepEqual(now(null), ["unchecked"]);
  assert.deepEqual(now({ verdict: { reason: null }, pairs: [pair] }), [pair]);
  assert.deepEqual(now({ verdict: { reason: "outdated" }, pairs: [] }), ["moved"]);
  assert.deepEqual(now({ verdict: { reason: "nothing-compared" }, pairs: [] }), ["unknown"]);
  const carpet = { median_mm: 1, max_mm: 2 };
  const fresh = { a: "l", b: "r", agreement: { carpet, hat: null }, verdict: { level: "good" } };
  rigCheck.value = { of: "hall", matches: [], found: { pairs: [fresh] } };
  assert.deepEqual(now({ verdict: { reason: null }, pairs: [pair] }), [
    { ...carpet, level: "good" },
  ]);
});

test("a field is drawn with y up and carpet around it, as its stitched picture is", () => {
  const frame = frameOf({ length_mm: 9000, width_mm: 6000 }),
    place = placeIn(frame);
  assert.deepEqual([frame.width, frame.height, frame.k], [1200, 825, 0.125]);
  assert.deepEqual(place([-4800, 3300]), [0, 0]);
  assert.deepEqual(place([0, 0]), [600, 412.5]);
  assert.equal(outline(LEFT, place, 6), "M43.5 43.5H594V781.5H43.5Z");
});
