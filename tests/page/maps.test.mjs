// Figures over the picture: a map's value between its places, and how long residual arrows are drawn.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { goTo } from "./window.mjs";
import "./features.mjs";
import { snapshot } from "../../static/core/state.js";
import { preview } from "../../static/features/calibrate/fitting.js";
import { differenceFrom, heat, valueAt } from "../../static/features/compare/heat.js";
import {
  FACTORS,
  arrows,
  factor,
  longest,
  longestOf,
  magnify,
  magnifyBy,
} from "../../static/features/compare/residual_arrows.js";

const MAP = {
  places: [
    [
      [0, 0],
      [100, 0],
    ],
    [
      [0, -100],
      [100, -100],
    ],
  ],
  values: [
    [1, 2],
    [5, 6],
  ],
};
const arrow = (px, outlier = false) => ({ px, outlier, mm: px, point: [0, 0], foot: [0, 0] });

beforeEach(() => {
  goTo("#/calibrate/abc/points");
  snapshot.value = { id: "abc", width: 1120, height: 840 }; // a diagonal of 1400 px: arrows up to 100 px can be read
  arrows.value = { on: true, factor: null };
});
const previewed = (...residuals) => {
  preview.value = { report: { mm_per_px: 5, per_feature: [{ feature: "left", residuals }] } };
};

test("between the places of a map its value is bilinear, and beyond them there is none", () => {
  const at = [
    [0, 0],
    [100, 0],
    [0, -100],
    [100, -100],
    [25, -75],
    [101, 0],
    [50, 1],
  ].map((p) => valueAt(MAP, p));
  assert.deepEqual(at, [1, 2, 5, 6, 4.25, null, null]);
  assert.equal(
    valueAt(
      {
        ...MAP,
        values: [
          [1, 2],
          [5, null],
        ],
      },
      [50, -50],
    ),
    null,
  );
});

test("a version is compared with the one that is asked for, else with the last one that was", () => {
  const others = ["a", "b", undefined].map((id) => {
    differenceFrom(id);
    return heat.value.other;
  });
  assert.deepEqual([others, heat.value.what], [["a", "b", "b"], "difference"]);
});

test("the longest arrow is told apart from the outliers', and one without a length is none", () => {
  const all = [arrow(1), arrow(null), arrow(3), arrow(40, true)];
  assert.deepEqual(
    [longestOf(all, false).px, longestOf(all, true).px, longestOf([arrow(null)], false)],
    [3, 40, null],
  );
});

test("arrows are magnified as far as the longest that is no outlier's can be read", () => {
  previewed(arrow(1.9), arrow(30, true));
  assert.equal(factor.value, 50);
  previewed(arrow(2.1), arrow(30, true));
  assert.equal(factor.value, 20);
  previewed(arrow(30, true));
  assert.equal(factor.value, 2);
  previewed(arrow(500));
  assert.equal(factor.value, 1);
  assert.equal(longest.value, 175);
});

test("the magnification goes from one step to the next, to the ends and back to what is chosen by itself", () => {
  previewed(arrow(2.1));
  magnifyBy(-1);
  assert.equal(factor.value, 10);
  for (let i = 0; i < FACTORS.length; i++) magnifyBy(1);
  assert.equal(factor.value, FACTORS.at(-1));
  magnify(1);
  magnifyBy(-1);
  assert.equal(factor.value, 1);
  magnify(null);
  assert.equal(factor.value, 20);
});
