// A border's curve while a point of it is dragged: the least-squares polynomial of the degree it has.
import assert from "node:assert/strict";
import { test } from "node:test";
import { curveThrough, leastSquares } from "../../static/features/calibrate/live_curve.js";

const near = (got, want, within = 1e-9) =>
  assert.ok(Math.abs(got - want) <= within, `${got} is not ${want}`);
const AT = [-1, -0.6, -0.1, 0.3, 0.7, 1];

/** An answer of the server: x = 80 + 6 t² down a picture, t from -1 to 1 at y 0 and 400. */
const value = (y) => 80 + 6 * (y / 200 - 1) ** 2;
const points = [0, 100, 200, 300, 400].map((y) => [value(y), y]);
const CURVE = {
  degree: 2,
  outliers: [],
  points,
  residuals_px: points.map(() => 0),
  rms_px: 0,
  curve: Array.from({ length: 9 }, (_, i) => [value(50 * i), 50 * i]),
};

test("values of a polynomial give that polynomial, of whichever degree that determines it", () => {
  for (const degree of [3, 4, 5]) {
    const fit = leastSquares(
      AT,
      AT.map((t) => 2 - t + 3 * t ** 3),
      degree,
    );
    for (const t of [-0.9, 0, 0.5]) near(fit(t), 2 - t + 3 * t ** 3);
  }
});

test("where values disagree, the sum of squares is smallest", () => {
  const values = [1, 0, 2, 1, 3, 2],
    sum = (f) => AT.reduce((all, t, i) => all + (f(t) - values[i]) ** 2, 0),
    best = leastSquares(AT, values, 1),
    slope = best(1) - best(0);
  for (const [a, b] of [
    [0.01, 0],
    [-0.01, 0],
    [0, 0.01],
    [0, -0.01],
  ])
    assert.ok(sum((t) => best(0) + a + (slope + b) * t) > sum(best));
});

test("too few positions for the degree determine nothing", () => {
  assert.equal(leastSquares([0, 0.5], [1, 2], 2), null);
  assert.equal(leastSquares([0.5, 0.5, 0.5], [1, 2, 3], 1), null);
  assert.equal(
    curveThrough(
      CURVE,
      points.map(([x]) => [x, 100]),
      1,
    ),
    null,
  );
});

test("points that stay where they are leave the curve as the server told it", () => {
  const same = curveThrough(CURVE, points, 1);
  for (const [i, [x, y]] of same.curve.entries()) {
    near(x, CURVE.curve[i][0]);
    assert.equal(y, CURVE.curve[i][1]);
  }
  near(same.rms_px, 0);
});

test("the curve bends to a point that moves, and tells by how much each is off", () => {
  const moved = points.map(([x, y], i) => [i === 2 ? x + 5 : x, y]);
  const bent = curveThrough(CURVE, moved, 1);
  assert.ok(bent.curve[4][0] > CURVE.curve[4][0] + 1);
  for (const [i, r] of bent.residuals_px.entries()) near(r, moved[i][0] - bent.curve[2 * i][0]);
  near(bent.rms_px, Math.sqrt(bent.residuals_px.reduce((sum, r) => sum + r * r, 0) / 5));
});

test("an outlier bends nothing and is not counted, and yet is told how far off it is", () => {
  const moved = points.map(([x, y], i) => [i === 2 ? x + 50 : x, y]);
  const bent = curveThrough({ ...CURVE, outliers: [2] }, moved, 1);
  near(bent.curve[4][0], CURVE.curve[4][0]);
  near(bent.residuals_px[2], 50);
  near(bent.rms_px, 0);
});

test("a border across the picture has its positions along x", () => {
  const across = (all) => all.map(([x, y]) => [y, x]);
  const bent = curveThrough(
    { ...CURVE, points: across(points), curve: across(CURVE.curve) },
    across(points),
    0,
  );
  near(bent.curve[4][1], CURVE.curve[4][0]);
  assert.equal(bent.curve[4][0], 200);
});
