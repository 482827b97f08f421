// Matches of two cameras of a rig: marked, completed, moved, removed and gone through; kept, and sent with a check.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { goTo } from "./window.mjs";
import "./features.mjs";
import { t } from "../../static/core/words.js";
import {
  kept,
  keep,
  keyOf,
  matchesIn,
  matchesOf,
} from "../../static/features/rigs/kept_matches.js";
import {
  chosen,
  complete,
  desk,
  isChanged,
  matchNextStep,
  members,
  nextHeight,
  pictures,
  side,
  views,
  wanted,
} from "../../static/features/rigs/match_desk.js";
import { matchErrors, worstMatch } from "../../static/features/rigs/match_lines.js";
import * as matches from "../../static/features/rigs/matches.js";
import { rigCheck, rigs } from "../../static/features/rigs/rig.js";

const PICTURE = { id: "left", width: 640, height: 480, camera: "north" };
const RIG = {
  name: "hall",
  cameras: [
    { camera: "north", title: "North", calibration: "n1" },
    { camera: "south", title: "South", calibration: "s1" },
  ],
};
const now = () => desk.doc.value.matches;
const click = (s, x, y) => {
  const { next, index } = matches.withClick(desk.doc.value, s, [x, y]);
  desk.change(next);
  return index;
};
/** So many complete matches. */
const clicked = (count) => {
  for (let i = 0; i < count; i++) ["a", "b"].forEach((s) => click(s, 10 * i, 20));
};

beforeEach(() => {
  rigs.value = [RIG];
  rigCheck.value = null;
  goTo("#/field/rigs/hall/north/south");
  pictures.value = { a: PICTURE, b: { ...PICTURE, id: "right", camera: "south" } };
  chosen.value = null;
  side.value = "a";
  nextHeight.value = 0;
  for (const s of ["a", "b"]) {
    views[s].size.value = { width: 700, height: 500 };
    views[s].fit(PICTURE);
  }
  desk.load({ pictures: { a: "left", b: "right" }, matches: [] });
});

test("a click begins a match, the next one in the other image completes it", () => {
  nextHeight.value = 150;
  assert.equal(click("b", 1.236, 2), 0);
  assert.deepEqual(now(), [{ a: null, b: [1.24, 2], z_mm: 150 }]);
  assert.deepEqual(wanted.value, { index: 0, side: "a", isNew: false });
  assert.equal(click("a", -9, 900), 0);
  assert.deepEqual(now(), [{ a: [-0.5, 479.5], b: [1.24, 2], z_mm: 150 }]);
  assert.equal(click("a", 3, 3), 1);
});

test("of several that wait, the chosen one is completed", () => {
  for (const x of [1, 2, 3])
    desk.change({ ...desk.doc.value, matches: [...now(), { a: [x, x], b: null, z_mm: 0 }] });
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
  desk.undo();
  assert.equal(now().length, 1);
});

test("the chosen point is nudged on its image, and its counterpart stays", () => {
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
  desk.load({ ...desk.doc.value, matches: [] });
  chosen.value = null;
  matches.chooseNext(1);
  assert.equal(chosen.value, null);
});

test("by the keyboard the other image comes next until the match is complete", () => {
  matches.addMatchPoint("a", [10, 10]);
  assert.equal(side.value, "b");
  matches.addMatchPoint("b", [20, 20]);
  assert.deepEqual([side.value, now().length, chosen.value], ["b", 1, { side: "b", index: 0 }]);
});

test("what to do next is said: take images, complete the match, check the rig", () => {
  const said = () => [matchNextStep.value.action, matchNextStep.value.sentence];
  assert.deepEqual(said(), ["check-rig", t("rig.match.step.first")]);
  click("a", 1, 1);
  assert.deepEqual(said(), ["check-rig", t("rig.match.step.click.b", { point: 1 })]);
  click("b", 1, 1);
  assert.deepEqual(
    [...said(), complete.value],
    ["check-rig", t("rig.match.step.check", { count: 1 }), 1],
  );
  rigs.value = [{ ...RIG, cameras: [RIG.cameras[0], { ...RIG.cameras[1], calibration: null }] }];
  assert.equal(said()[1], t("rig.match.step.uncalibrated", { camera: "South" }));
  pictures.value = { a: PICTURE, b: null };
  assert.deepEqual(said(), ["take-match-images", t("rig.match.step.take")]);
  goTo("#/field/rigs/hall/north/west");
  assert.deepEqual([members.value, said()[1]], [null, t("rig.match.no-such")]);
});

test("a figure of the check is its match's, also after others are removed, and goes when it is moved", () => {
  clicked(3);
  click("a", 40, 20);
  keep(keyOf("hall", "north", "south"), desk.doc.value);
  const sent = matchesOf(RIG);
  assert.deepEqual(sent, [
    {
      a: "north",
      b: "south",
      points_a: [
        [0, 20],
        [10, 20],
        [20, 20],
      ],
      points_b: [
        [0, 20],
        [10, 20],
        [20, 20],
      ],
      z_mm: [0, 0, 0],
    },
  ]);
  const told = {
    calibrated: { epipolar_px: [1, 9, 3] },
    agreement: null,
    fundamental: { outliers: [1] },
    failed: [],
  };
  rigCheck.value = {
    of: "hall",
    matches: sent,
    found: { pairs: [{ a: "north", b: "south", matches: told }] },
  };
  assert.deepEqual([worstMatch.value, isChanged.value], [1, false]);
  matches.removeMatch(0);
  assert.deepEqual(
    matchErrors.value.map(({ px, isMistake }) => [px, isMistake]),
    [
      [9, true],
      [3, false],
      [null, false],
    ],
  );
  assert.deepEqual([worstMatch.value, isChanged.value], [0, true]);
  matches.choose(0, "b");
  matches.nudgeChosen(0.1, 0);
  assert.equal(matchErrors.value[0].px, null);
});

test("matches are kept by their two images, and are found from either side", () => {
  const key = keyOf("hall", "north", "south");
  clicked(1);
  keep(key, desk.doc.value);
  keep(key, { pictures: { a: "new", b: "newer" }, matches: [] });
  assert.deepEqual(kept(key), { pictures: { a: "new", b: "newer" }, matches: [] });
  assert.deepEqual(matchesOf(RIG), []);
  localStorage.setItem(
    "touchline.pair.left.right",
    '{"matches":[{"a":[1,2],"b":[3,4],"z_mm":5}],"calibrations":{}}',
  );
  assert.deepEqual(matchesIn("left", "right"), [{ a: [1, 2], b: [3, 4], z_mm: 5 }]);
  assert.deepEqual(matchesIn("right", "left"), [{ a: [3, 4], b: [1, 2], z_mm: 5 }]);
});
