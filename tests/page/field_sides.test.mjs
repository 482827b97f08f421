// The region as it lies in the corrected picture: turned, its sides, and the painted line that each border is.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { EMPTY, load } from "../../static/core/document.js";
import { fields } from "../../static/core/state.js";
import {
  arcPoints,
  lineUnder,
  rectOf,
  sideOf,
  turned,
} from "../../static/features/calibrate/field_sides.js";
import { blankField } from "../../static/features/fields/document.js";

const plain = (point) => point.map((v) => v + 0); // no negative zero
const HALF = { x: [0, 2250], y: [-1500, 1500] };
const borders = () =>
  Object.fromEntries(
    ["left", "right", "top", "bottom"].map((border) => [border, lineUnder(border)]),
  );

beforeEach(() => {
  fields.value = [{ ...blankField(), name: "lab" }];
});

test("the field's y is up and the drawing's is down, and it is turned counter-clockwise", () => {
  assert.deepEqual(
    [0, 90, 180, 270].map((deg) => plain(turned([3, 1], deg))),
    [
      [3, -1],
      [-1, -3],
      [-3, 1],
      [1, 3],
    ],
  );
  assert.deepEqual(rectOf(HALF, 0), { x: 0, y: -1500, width: 2250, height: 3000 });
  assert.deepEqual(rectOf(HALF, 90), { x: -1500, y: -2250, width: 3000, height: 2250 });
});

test("a rectangle has four sides", () => {
  const rect = { x: 1, y: 2, width: 10, height: 20 };
  assert.deepEqual(
    ["left", "right", "top", "bottom"].map((border) => sideOf(rect, border)),
    [
      [
        [1, 2],
        [1, 22],
      ],
      [
        [11, 2],
        [11, 22],
      ],
      [
        [1, 2],
        [11, 2],
      ],
      [
        [1, 22],
        [11, 22],
      ],
    ],
  );
});

test("each border is the painted line that it lies on, however the field is turned", () => {
  load({ ...EMPTY, field: "lab", region: "half-right" });
  assert.deepEqual(borders(), {
    left: "halfway-line",
    right: "goal-line-right",
    top: "touch-line-top",
    bottom: "touch-line-bottom",
  });
  load({ ...EMPTY, field: "lab", region: "half-right", rotate: 180 });
  assert.deepEqual(borders(), {
    left: "goal-line-right",
    right: "halfway-line",
    top: "touch-line-bottom",
    bottom: "touch-line-top",
  });
  load({ ...EMPTY, field: "lab", region: "half-right", rotate: 90 });
  assert.equal(lineUnder("top"), "goal-line-right");
});

test("where nothing is painted, and without a region, a border is no line", () => {
  fields.value = [
    { ...fields.value[0], regions: { part: { x: [-1000, 1000], y: [-1500, 1500], rotate: 0 } } },
  ];
  load({ ...EMPTY, field: "lab", region: "part" });
  assert.deepEqual([lineUnder("left"), lineUnder("top")], [null, "touch-line-top"]);
  load({ ...EMPTY, field: "lab" });
  assert.equal(lineUnder("top"), null);
});

test("an arc is drawn from its start to its end", () => {
  const points = arcPoints({ centre: [10, 20], radius_mm: 5, start_deg: 0, end_deg: 90 });
  assert.deepEqual(points[0], [15, 20]);
  assert.ok(Math.hypot(points.at(-1)[0] - 10, points.at(-1)[1] - 25) < 1e-9);
  assert.ok(points.every(([x, y]) => Math.abs(Math.hypot(x - 10, y - 20) - 5) < 1e-9));
});
