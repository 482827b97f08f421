// Clicked points: added, moved and removed on the picture, and gone through in the order in which the eye meets them.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { EMPTY, doc, load, pointsOf } from "../../static/core/document.js";
import { active, fields, selection, snapshot } from "../../static/core/state.js";
import * as editing from "../../static/features/calibrate/editing.js";

const FIELD = {
  name: "lab",
  lines: [{ name: "halfway-line" }],
  arcs: [{ name: "centre-circle" }],
  regions: {},
  landmarks: { centre: [0, 0] },
};
const LEFT = [
  [80, 300],
  [80, 100],
  [80, 200],
]; // not in the order in which they lie
const TOP = [
  [400, 60],
  [100, 60],
];

beforeEach(() => {
  fields.value = [FIELD];
  snapshot.value = { id: "a", width: 640, height: 480 };
  selection.value = [];
  active.value = "left";
  load({
    ...EMPTY,
    field: "lab",
    observations: [
      { feature: "left", kind: "line", points: LEFT },
      { feature: "top", kind: "line", points: TOP },
    ],
  });
});

test("a point is kept to a hundredth of a pixel and stays on the picture", () => {
  const added = (x, y) => pointsOf(editing.withAdded(doc.value, "right", x, y).next, "right");
  assert.deepEqual(added(560.126, 99.994), [[560.13, 99.99]]);
  assert.deepEqual(added(-20, 900), [[-0.5, 479.5]]);
  assert.deepEqual(
    [editing.isOnPicture(-0.5, 479.5), editing.isOnPicture(0, 479.6)],
    [true, false],
  );
});

test("a line takes every point, and a landmark the last one", () => {
  const first = editing.withAdded(doc.value, "centre", 10, 10);
  const second = editing.withAdded(first.next, "centre", 20, 20);
  assert.deepEqual(second.next.observations.at(-1), {
    feature: "centre",
    kind: "landmark",
    points: [[20, 20]],
  });
  assert.deepEqual(second.pick, { feature: "centre", index: 0 });
  assert.deepEqual(editing.withAdded(doc.value, "left", 1, 2).pick, { feature: "left", index: 3 });
});

test("the selected points are nudged and no others, those that are gone are not", () => {
  selection.value = [
    { feature: "left", index: 1 },
    { feature: "left", index: 7 },
  ];
  editing.nudge(0.1, 0);
  editing.nudge(0.1, -1);
  assert.deepEqual(pointsOf(doc.value, "left"), [
    [80, 300],
    [80.2, 99],
    [80, 200],
  ]);
  assert.deepEqual(pointsOf(doc.value, "top"), TOP);
});

test("removing leaves the neighbour selected, and nothing after the last one", () => {
  editing.remove([{ feature: "left", index: 2 }]);
  assert.deepEqual(
    [pointsOf(doc.value, "left"), selection.value],
    [LEFT.slice(0, 2), [{ feature: "left", index: 1 }]],
  );
  editing.remove([
    { feature: "left", index: 0 },
    { feature: "left", index: 1 },
    { feature: "top", index: 0 },
  ]);
  assert.deepEqual([pointsOf(doc.value, "left"), pointsOf(doc.value, "top")], [[], TOP.slice(1)]);
  assert.deepEqual(selection.value, []);
});

test("the next point is the next along its border, and after the last there is none, or the first", () => {
  const order = [];
  while (editing.selectNext(1, false))
    order.push(`${selection.value[0].feature}:${selection.value[0].index}`);
  assert.deepEqual(order, ["left:1", "left:2", "left:0", "top:1", "top:0"]);
  assert.equal(active.value, "top");
  assert.equal(editing.selectNext(1, true), true);
  assert.deepEqual(selection.value, [{ feature: "left", index: 1 }]);
  assert.equal(editing.selectNext(-1, false), false);
});

test("going through the points begins at the border that is being clicked", () => {
  editing.activateFeature("top");
  editing.selectNext(1, true);
  assert.deepEqual(selection.value, [{ feature: "top", index: 1 }]);
  editing.activateFeature("top");
  assert.deepEqual(selection.value, []);
  load(EMPTY);
  assert.equal(editing.selectNext(1, true), false);
});

test("what a field does not have is left out of what is fitted, a place of one's own is not", () => {
  const on = (feature) => ({ feature, kind: "line", points: [[1, 1]] });
  const kept = editing.onField(
    ["left", "halfway-line", "centre-line", "centre", [100, 200]].map(on),
    FIELD,
  );
  assert.deepEqual(
    kept.map((o) => o.feature),
    ["left", "halfway-line", "centre", [100, 200]],
  );
});
