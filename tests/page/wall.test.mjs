// The order of the cameras on the wall.
import assert from "node:assert/strict";
import { test } from "node:test";
import "./features.mjs";
import { wallOrder } from "../../static/features/live/wall.js";

const LISTED = ["east", "north", "west"];

test("cameras in trouble stand first, the others as they are listed", () => {
  assert.deepEqual(wallOrder(LISTED, new Set(), [], false), LISTED);
  assert.deepEqual(wallOrder(LISTED, new Set(["west", "north"]), LISTED, false), [
    "north",
    "west",
    "east",
  ]);
});

test("while the operator is in the wall, nothing moves; a new camera comes last, one that is gone leaves", () => {
  assert.deepEqual(wallOrder(LISTED, new Set(["west"]), LISTED, true), LISTED);
  assert.deepEqual(wallOrder(["aside", "east", "west"], new Set(["west"]), LISTED, true), [
    "east",
    "west",
    "aside",
  ]);
});
