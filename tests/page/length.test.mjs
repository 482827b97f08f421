// A length as people type it: with a unit or without, with a decimal comma or point.
import assert from "node:assert/strict";
import { test } from "node:test";
import { parseLength, parseNumber } from "../../static/core/length.js";

const HEIGHT = [100, 50_000];
const read = (text, range = HEIGHT) => {
  const found = parseLength(text, range);
  return found && [found.mm, found.unit, found.isGuessed];
};

test("a number has a decimal comma or point, and any mark between thousands", () => {
  const texts = [
    "5,2",
    "5.2",
    "5 200",
    "5\u202f200",
    "5.200,5",
    "5,200.5",
    "1,234,567",
    "-3",
    "7.",
  ];
  assert.deepEqual(
    texts.map(parseNumber),
    [5.2, 5.2, 5200, 5200, 5200.5, 5200.5, 1_234_567, -3, 7],
  );
  for (const text of ["", "m", "1-2", ",", "5,2,", "--3"])
    assert.ok(Number.isNaN(parseNumber(text)), text);
});

test("a unit that is typed is taken, whatever the range", () => {
  assert.deepEqual(read("5 m"), [5000, "m", false]);
  assert.deepEqual(read("5,20 m"), [5200, "m", false]);
  assert.deepEqual(read("520 cm"), [5200, "cm", false]);
  assert.deepEqual(read("5200MM"), [5200, "mm", false]);
  assert.deepEqual(read("90 m"), [90_000, "m", false]);
});

test("a plain number is millimetres, and where those are impossible metres or centimetres", () => {
  assert.deepEqual(read("5200"), [5200, "mm", false]);
  assert.deepEqual(read("5"), [5000, "m", true]);
  assert.deepEqual(read("5,2"), [5200, "m", true]);
  assert.deepEqual(read("5.200"), [5200, "m", true]);
  assert.deepEqual(read("80"), [800, "cm", true]);
  assert.deepEqual(read("0"), [0, "mm", false]); // the server refuses it
  assert.deepEqual(read("5", null), [5, "mm", false]);
});

test("what is no length is none", () => {
  for (const text of ["", "five", "5 km", "5 m 20", "m"]) assert.equal(read(text), null, text);
});
