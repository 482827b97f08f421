// How a field's markings move: what is joined moves together unless it is to move alone, and a size takes all with it.
import assert from "node:assert/strict";
import { test } from "node:test";
import { blankField } from "../../static/features/fields/document.js";
import * as geometry from "../../static/features/fields/geometry.js";
import { gripsOf, snapped } from "../../static/features/fields/grips.js";

const FIELD = blankField(4500, 3000); // a circle of 250 mm, regions "full", halves and quarters
const mark = (name, kind = "line") => ({ kind, name });
const lineOf = (doc, name) => doc.lines.find((line) => line.name === name);
const grip = (name, part, kind) => ({ mark: mark(name, kind), part, at: [0, 0] });

test("a line takes with it what ends or lies on it, and the edges of the parts along it", () => {
  const moved = geometry.withMoved(FIELD, [mark("goal-line-right")], [-15, 0]);
  assert.deepEqual(lineOf(moved, "goal-line-right"), {
    ...lineOf(FIELD, "goal-line-right"),
    from: [2235, -1500],
    to: [2235, 1500],
  });
  assert.deepEqual(lineOf(moved, "touch-line-top").to, [2235, 1500]);
  assert.deepEqual(lineOf(moved, "centre-line").to, [2235, 0]); // it ends on it
  assert.deepEqual(moved.landmarks["corner-top-right"], [2235, 1500]);
  assert.deepEqual(moved.landmarks["corner-top-left"], [-2250, 1500]);
  assert.deepEqual(
    [moved.regions.full.x, moved.regions["half-left"].x],
    [[-2250, 2235], FIELD.regions["half-left"].x],
  );
  assert.deepEqual(lineOf(moved, "halfway-line"), lineOf(FIELD, "halfway-line"));
});

test("alone, only the chosen mark moves", () => {
  const moved = geometry.withMoved(FIELD, [mark("goal-line-right")], [-15, 0], true);
  assert.deepEqual(lineOf(moved, "goal-line-right").from, [2235, -1500]);
  assert.deepEqual(
    [lineOf(moved, "touch-line-top"), moved.landmarks, moved.regions],
    [lineOf(FIELD, "touch-line-top"), FIELD.landmarks, FIELD.regions],
  );
});

test("a circle takes what lies on it and its centre with it", () => {
  const moved = geometry.withMoved(FIELD, [mark("centre-circle", "arc")], [10, 20]);
  assert.deepEqual(moved.arcs[0].centre, [10, 20]);
  assert.deepEqual(
    [moved.landmarks["circle-top"], moved.landmarks.centre],
    [
      [10, 270],
      [10, 20],
    ],
  );
});

test("the end of a line is held with all that meets there, or alone", () => {
  const held = grip("goal-line-left", "to");
  const together = geometry.withGripAt(FIELD, held, [-2240.04, 1490]);
  assert.deepEqual(
    [
      lineOf(together, "goal-line-left").to,
      lineOf(together, "touch-line-top").from,
      together.landmarks["corner-top-left"],
    ],
    [
      [-2240, 1490],
      [-2240, 1490],
      [-2240, 1490],
    ],
  );
  const alone = geometry.withGripAt(FIELD, held, [-2240, 1490], true);
  assert.deepEqual(
    [
      lineOf(alone, "goal-line-left").to,
      lineOf(alone, "touch-line-top").from,
      alone.landmarks["corner-top-left"],
    ],
    [
      [-2240, 1490],
      [-2250, 1500],
      [-2250, 1500],
    ],
  );
});

test("a circle's radius takes what lies on it along, and an edge of a part moves that part alone", () => {
  const wide = geometry.withGripAt(FIELD, grip("centre-circle", "radius", "arc"), [300, 0]);
  assert.deepEqual(
    [wide.arcs[0].radius_mm, wide.landmarks["circle-top"], wide.landmarks.centre],
    [300, [0, 300], [0, 0]],
  );
  const part = geometry.withGripAt(FIELD, grip("half-right", "x0", "region"), [-100, 0]);
  assert.deepEqual(
    [part.regions["half-right"].x, part.regions["half-left"]],
    [[-100, 2250], FIELD.regions["half-left"]],
  );
  assert.deepEqual(part.lines, FIELD.lines);
});

test("what can be held of a mark is where it is", () => {
  const at = (name, kind) =>
    Object.fromEntries(gripsOf(FIELD, mark(name, kind)).map((g) => [g.part, g.at]));
  assert.deepEqual(at("halfway-line"), { from: [0, -1500], to: [0, 1500] });
  assert.deepEqual(at("full", "region"), {
    x0: [-2250, 0],
    x1: [2250, 0],
    y0: [0, -1500],
    y1: [0, 1500],
  });
  assert.deepEqual(Object.keys(at("centre-circle", "arc")), ["radius"]); // a full circle has no ends
  assert.deepEqual([at("centre", "landmark"), at("nothing")], [{}, {}]);
  const half = { ...FIELD, arcs: [{ ...FIELD.arcs[0], end_deg: 180 }] };
  assert.deepEqual(
    gripsOf(half, mark("centre-circle", "arc")).map((g) => g.part),
    ["radius", "start", "end"],
  );
});

test("a held place is drawn to another one within reach, else to a grid of 5 mm, and never to where it was", () => {
  assert.deepEqual(snapped(FIELD, [2244, 1504], 20, null), [2250, 1500]);
  assert.deepEqual(snapped(FIELD, [2244, 1504], 20, [2250, 1500]), [2245, 1505]);
  assert.deepEqual(snapped(FIELD, [1002, -2], 20, null), [1000, 0]);
});

test("distances from a line end at its ends, those from an arc too", () => {
  const line = { from: [0, 0], to: [100, 0] };
  assert.deepEqual(
    [
      [50, 30],
      [130, 40],
      [-30, 0],
    ].map((p) => geometry.fromLine(p, line)),
    [30, 50, 30],
  );
  const arc = { centre: [0, 0], radius_mm: 100, start_deg: 0, end_deg: 90 };
  assert.ok(Math.abs(geometry.fromArc([60, 80], arc)) < 1e-9);
  assert.ok(Math.abs(geometry.fromArc([100, -30], arc) - 30) < 1e-9);
});

test("a scaled field takes everything with it, and its circles stay circles whichever side is typed first", () => {
  const byLength = geometry.withSize(
      geometry.withSize(FIELD, 9000, 3000, "scale"),
      9000,
      6000,
      "scale",
    ),
    byWidth = geometry.withSize(geometry.withSize(FIELD, 4500, 6000, "scale"), 9000, 6000, "scale");
  assert.deepEqual(byLength, { ...byWidth, arcs: byLength.arcs, landmarks: byLength.landmarks });
  assert.ok(
    Math.abs(byLength.arcs[0].radius_mm - 500) < 0.2 &&
      Math.abs(byWidth.arcs[0].radius_mm - 500) < 0.2,
  );
  const twice = geometry.withSize(FIELD, 9000, 6000, "scale");
  assert.deepEqual(
    [twice.landmarks["circle-top"], twice.regions["quarter-top-left"].x],
    [
      [0, 500],
      [-4500, 0],
    ],
  );
});

test("moved borders leave what is in the middle as large as it is", () => {
  const larger = geometry.withSize(FIELD, 5500, 3400, "borders");
  assert.deepEqual(
    [lineOf(larger, "goal-line-left").from, larger.arcs, larger.landmarks["circle-top"]],
    [[-2750, -1700], FIELD.arcs, [0, 250]],
  );
});
