// A held frame of a clip: it becomes a snapshot where colours are taught from it.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { goTo } from "./window.mjs";
import "./features.mjs";
import { cameras } from "../../static/core/state.js";
import {
  asSnapshot,
  heldFrame,
  holdClipFrame,
} from "../../static/features/detection/held_frame.js";

const CLIP = { clip: "c1", camera: "east", width: 640, height: 480, frames: 9 };
let onSaving = () => {};

beforeEach(() => {
  cameras.value = [{ id: "east", name: "East", active_calibration: null }];
  goTo("#/cameras/east/detection");
  onSaving = () => {};
});
globalThis.fetch = async (_path, { method }) => {
  if (method === "POST") onSaving();
  return method === "POST" ? Response.json({ id: "s1" }) : new Response(new Blob(["jpeg"]));
};

test("a frame of a clip is saved once, and stays the frame that is held", async () => {
  holdClipFrame(CLIP, 4);
  assert.deepEqual([await asSnapshot(), await asSnapshot()], ["s1", "s1"]);
  assert.deepEqual([heldFrame.value.number, heldFrame.value.id], [4, "s1"]);
});

test("another frame that is held while one is saved stays the one that is held", async () => {
  holdClipFrame(CLIP, 4);
  onSaving = () => holdClipFrame(CLIP, 5);
  assert.equal(await asSnapshot(), "s1");
  assert.deepEqual([heldFrame.value.number, heldFrame.value.id], [5, ""]);
});
