// The tabs beside a view: those of its place, of a camera its own, and the one that stands for a view behind it.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { goTo } from "./window.mjs";
import "./features.mjs";
import { cameras, isNowhere, listed, namedCamera, nextCamera } from "../../static/core/state.js";
import { tabs } from "../../static/features/shell/places.js";

const shown = () => tabs.value.filter((tab) => tab.isShown).map((tab) => tab.view);

beforeEach(() => {
  listed.value = true;
  cameras.value = [
    { id: "east", active_calibration: "abc" },
    { id: "west", active_calibration: null },
  ];
});

test("a camera has tabs of its own, and the wall has none", () => {
  goTo("#/cameras/west/drift");
  assert.deepEqual([namedCamera.value.id, shown()], ["west", ["drift"]]);
  assert.ok(tabs.value.every((tab) => tab.href.startsWith("#/cameras/west/")));
  goTo("#/cameras");
  assert.deepEqual(tabs.value, []);
});

test("a view behind a tab shows that tab", () => {
  for (const [address, view] of [
    ["#/field/rigs/hall", "field"],
    ["#/field/new", "field"],
    ["#/field/fields/lab", "field"],
    ["#/field/new-field", "field"],
    ["#/lenses/board/east", "board"],
  ]) {
    goTo(address);
    assert.deepEqual(shown(), [view], address);
  }
});

test("the ball rolls before a camera: the named one, else the first, and without one it has no tab", () => {
  const ball = () => tabs.value.find((tab) => tab.view === "ball")?.href;
  goTo("#/lenses/ball/west");
  assert.equal(ball(), "#/lenses/ball/west");
  goTo("#/lenses");
  assert.equal(ball(), "#/lenses/ball/east");
  cameras.value = [];
  assert.equal(ball(), undefined);
});

test("a camera that there is not is nowhere once the list is there, its versions outlive it", () => {
  goTo("#/cameras/nobody/live");
  assert.equal(isNowhere.value, true);
  goTo("#/cameras/nobody/versions");
  assert.equal(isNowhere.value, false);
  listed.value = false;
  goTo("#/cameras/nobody/live");
  assert.equal(isNowhere.value, false);
});

test("the next camera to calibrate is the first without an active version, else the first", () => {
  assert.equal(nextCamera.value.id, "west");
  cameras.value = [cameras.value[0]];
  assert.equal(nextCamera.value.id, "east");
  cameras.value = [];
  assert.equal(nextCamera.value, null);
});
