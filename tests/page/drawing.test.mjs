// What is drawn over the picture: paths with gaps, and messages of JSON and bytes as the server frames them.
import assert from "node:assert/strict";
import { test } from "node:test";
import { bounds, colour, path } from "../../static/canvas/drawing.js";
import { parts } from "../../static/core/framing.js";

test("a path has a gap where a point is out of reach", () => {
  assert.equal(path([[1, 2], [3.5, 4.25], null, [5, 6]]), "M1.000 2.000L3.500 4.250M5.000 6.000");
  assert.equal(path([]), "");
});

test("the box around points is told by its size and its middle, without those out of reach", () => {
  assert.deepEqual(bounds([[0, 10], null, [4, 30]]), { width: 4, height: 20, x: 2, y: 20 });
});

test("each border has a colour of its own, and all else one", () => {
  const colours = ["left", "right", "top", "bottom", "halfway-line"].map(colour);
  assert.equal(new Set(colours).size, 5);
  assert.equal(colour("centre-circle"), colours[4]);
});

test("a message is its JSON and the bytes after it", () => {
  const head = new TextEncoder().encode(JSON.stringify({ seq: 7, name: "Größe" }));
  const message = new Uint8Array(4 + head.length + 3);
  new DataView(message.buffer).setUint32(0, head.length, true);
  message.set(head, 4);
  message.set([1, 2, 3], 4 + head.length);
  const { head: told, payload } = parts(message.buffer);
  assert.deepEqual([told, [...payload]], [{ seq: 7, name: "Größe" }, [1, 2, 3]]);
});
