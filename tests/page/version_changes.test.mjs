// The small map of what a version changed: arrows on the area, in a box.
import assert from "node:assert/strict";
import { test } from "node:test";
import "./features.mjs";
import { arrowsOf } from "../../static/features/versions/changes.js";

/** @param {number} rows @param {number} columns @param {(r: number, c: number) => any} of */
const grid = (rows, columns, of) =>
  [...Array(rows).keys()].map((r) => [...Array(columns).keys()].map((c) => of(r, c)));
const over = (vector) => ({
  places: grid(19, 25, (r, c) => [100 * c, -100 * r]),
  mm: grid(19, 25, (r, c) => (vector(r, c)[0] === null ? null : Math.hypot(...vector(r, c)))),
  mm_vector: grid(19, 25, vector),
  px: [],
});

test("arrows are in the box, up on the field is up in it, and the longest does not cross the next", () => {
  const found = arrowsOf(
    over((_, c) => [0, c / 24]),
    96,
    72,
  );
  assert.equal(found.length, 35);
  assert.ok(found.every(({ was: [x, y] }) => x > 0 && x < 96 && y > 0 && y < 72));
  const lengths = found.map(({ was, now }) => was[1] - now[1]);
  assert.ok(lengths.every((length) => length >= 0 && length < 96 / 7));
  assert.ok(Math.max(...lengths) > 10);
});

test("out of reach there is none, and two versions that are alike show dots", () => {
  assert.equal(
    arrowsOf(
      over((r) => (r < 10 ? [null, null] : [1, 0])),
      96,
      72,
    ).length,
    14,
  );
  const still = arrowsOf(
    over(() => [0, 0]),
    96,
    72,
  );
  assert.ok(still.every(({ was, now }) => was[0] === now[0] && was[1] === now[1]));
});
