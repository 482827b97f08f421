// The time line of a camera's displacement, and the arrows on its picture.
import assert from "node:assert/strict";
import { test } from "node:test";
import "./window.mjs";
import { arrowPath, drawnPlaces } from "../../static/canvas/arrows.js";
import { axesOf, largestOf, rowsOf } from "../../static/features/drift/timeline.js";

const HOUR = 3600;
/** @param {number} at @param {string} kind */
const event = (at, kind) => ({ at: new Date(1000 * at).toISOString(), kind, text: kind });

test("an event is in the row of its entry, at its own time, and an earlier one in none", () => {
  const history = [
    { at: 100, mm: 0.1 },
    { at: 120, mm: 9 },
    { at: 140, mm: null },
  ];
  const rows = rowsOf(
    history,
    [event(139, "moved"), event(125, "back"), event(90, "activated")],
    20,
  );
  assert.deepEqual(
    rows.map(({ at, entry, mm, events }) => [at, entry, mm, events.map((one) => one.kind)]),
    [
      [100, 100, 0.1, []],
      [125, 120, 9, ["back", "moved"]],
      [140, 140, null, []],
    ],
  );
});

test("stops are events, the largest of each quarter of an hour, and the newest", () => {
  const history = Array.from({ length: 6 }, (_, i) => ({
    at: HOUR + 300 * i,
    mm: [1, 3, 2, 5, 4, 3][i],
  }));
  const rows = rowsOf(history, [event(HOUR + 600, "offline")], 20);
  assert.deepEqual(
    rows.map(({ isStop }) => isStop),
    [false, true, true, true, false, true],
  );
});

test("both axes are wide enough for little, and for much", () => {
  const rows = rowsOf([{ at: 1000, mm: 0.1 }], [], 20);
  assert.deepEqual(axesOf(rows, 1.5, 20).time, [420, 1020]);
  assert.ok(axesOf(rows, 1.5, 20).mm[1] > 2);
  assert.ok(axesOf(rowsOf([{ at: 0, mm: 40 }], [], 20), 1.5, 20).mm[1] > 40);
  assert.equal(largestOf(rowsOf([{ at: 0, mm: null }], [], 20)), null);
});

test("an arrow is as long as it is magnified, and a place that stays is a dot", () => {
  assert.match(arrowPath({ was: [10, 20], now: [12, 20] }, 10, 500), /^M10 20L30\.0 20\.0M/);
  assert.equal(arrowPath({ was: [10, 20], now: [10.01, 20] }, 10, 500), "M10 20h0.01");
});

test("of places near each other, the farthest displaced is drawn", () => {
  const at = (/** @type {number} */ x, /** @type {number} */ mm) => ({ was: [x, 0], mm });
  assert.deepEqual(
    drawnPlaces([at(0, 1), at(5, 2), at(100, 0.5)], 1000).map((place) => place.mm),
    [2, 0.5],
  );
});
