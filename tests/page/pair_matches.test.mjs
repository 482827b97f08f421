// Matches of two pictures: clicked, completed, moved, removed and gone through; what is missing, in one sentence.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { goTo } from "./window.mjs";
import { t } from "../../static/core/words.js";
import * as matches from "../../static/features/pair/matches.js";
import { ENOUGH, chosen, complete, missing, nextHeight, pair, pictures, side, suitedCalibrations, views,
  wantedHeight } from "../../static/features/pair/pair.js";

const PICTURE = { id: "left", width: 640, height: 480, camera: null };
const now = () => pair.doc.value.matches;
const click = (s, x, y) => {
  const { next, index } = matches.withClick(pair.doc.value, s, x, y);
  pair.change(next);
  return index;
};
/** So many complete matches. */
const clicked = (count) => {
  for (let i = 0; i < count; i++) ["a", "b"].forEach((s) => click(s, 10 * i, 20));
};

beforeEach(() => {
  goTo("#/field/pairs/left/right");
  pictures.value = { a: PICTURE, b: { ...PICTURE, id: "right" } };
  suitedCalibrations.value = { a: [], b: [] };
  chosen.value = null;
  side.value = "a";
  nextHeight.value = 0;
  for (const s of ["a", "b"]) {
    views[s].size.value = { width: 700, height: 500 };
    views[s].fit(PICTURE);
  }
  pair.load({ matches: [], calibrations: { a: null, b: null } });
});

test("a click begins a match, the next one in the other picture completes it", () => {
  nextHeight.value = 150;
  assert.equal(click("b", 1.236, 2), 0);
  assert.deepEqual(now(), [{ a: null, b: [1.24, 2], z_mm: 150 }]);
  assert.deepEqual(wantedHeight.value, { index: 0, side: "a", isNew: false });
  assert.equal(click("a", -9, 900), 0);
  assert.deepEqual(now(), [{ a: [-0.5, 479.5], b: [1.24, 2], z_mm: 150 }]);
  assert.equal(click("a", 3, 3), 1);
});

test("of several that wait, the chosen one is completed", () => {
  for (const x of [1, 2, 3]) pair.change({ ...pair.doc.value, matches: [...now(), { a: [x, x], b: null, z_mm: 0 }] });
  chosen.value = { side: "a", index: 1 };
  assert.equal(click("b", 9, 9), 1);
  assert.equal(click("b", 8, 8), 0);
});

test("the last match removed leaves the one before chosen, and the very last leaves none", () => {
  clicked(3);
  matches.choose(2);
  matches.removeMatch(2);
  assert.deepEqual([now().length, chosen.value], [2, { side: "a", index: 1 }]);
  matches.removeMatch(0);
  assert.deepEqual([now().length, chosen.value], [1, { side: "a", index: 0 }]);
  matches.removeMatch(0);
  assert.deepEqual([now(), chosen.value], [[], null]);
  pair.undo();
  assert.equal(now().length, 1);
});

test("the chosen point is nudged on its picture, and its counterpart stays", () => {
  clicked(2);
  matches.choose(1, "b");
  matches.nudgeChosen(0.1, 0);
  matches.nudgeChosen(0, -30);
  assert.deepEqual(now()[1], { a: [10, 20], b: [10.1, -0.5], z_mm: 0 });
  assert.deepEqual(matches.chosenPoint(), [10.1, -0.5]);
  chosen.value = null;
  matches.nudgeChosen(5, 5);
  assert.deepEqual([now()[1].b, matches.chosenPoint()], [[10.1, -0.5], null]);
});

test("matches are gone through in a circle, and a half one is chosen where its point is", () => {
  clicked(2);
  click("b", 5, 5);
  const seen = [1, 1, 1, 1, -1].map((way) => {
    matches.chooseNext(way);
    return `${chosen.value.side}${chosen.value.index}`;
  });
  assert.deepEqual(seen, ["a0", "a1", "b2", "b0", "b2"]);
  assert.equal(side.value, "b");
  pair.load({ ...pair.doc.value, matches: [] });
  chosen.value = null;
  matches.chooseNext(1);
  assert.equal(chosen.value, null);
});

test("by the keyboard the other picture comes next until the match is complete", () => {
  matches.addMatchPoint("a", [10, 10]);
  assert.equal(side.value, "b");
  matches.addMatchPoint("b", [20, 20]);
  assert.deepEqual([side.value, now().length, chosen.value], ["b", 1, { side: "b", index: 0 }]);
});

test("what is missing is said until twelve matches, or two calibrations, are there", () => {
  pictures.value = { a: PICTURE, b: null };
  assert.equal(missing.value, t("pair.missing.choose.b"));
  pictures.value = { a: PICTURE, b: { ...PICTURE, id: "right" } };
  assert.equal(missing.value, t("pair.missing.first"));
  click("a", 1, 1);
  assert.equal(missing.value, t("pair.missing.click.b", { point: 1 }));
  click("b", 1, 1);
  assert.equal(missing.value, t("pair.missing.more", { count: ENOUGH - 1 }));
  clicked(ENOUGH - 1);
  assert.deepEqual([missing.value, complete.value], ["", ENOUGH]);
  pair.load({ matches: [], calibrations: { a: null, b: null } });
  const of = (id, more) => ({ id: `of-${id}`, snapshot: id, active: false, camera: null, field_definition: {}, ...more });
  suitedCalibrations.value = { a: [of("left")], b: [of("right")] };
  assert.equal(missing.value, "");
});
