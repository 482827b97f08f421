// Numbers, times and names as an English reader reads them.
import assert from "node:assert/strict";
import { test } from "node:test";
import * as format from "../../static/core/format.js";

test("a number has a true minus, thin spaces between thousands, and no minus before a zero", () => {
  const { number } = format;
  assert.deepEqual(
    [1234567.25, -0.5, -0.04, 999].map((v) => number(v)),
    ["1\u202f234\u202f567.3", "−0.5", "0.0", "999.0"],
  );
  assert.deepEqual([number(12.5, 0), number(0.125, 3)], ["13", "0.125"]);
});

test("what is not known is a dash", () => {
  assert.equal(format.number(Infinity), "–");
  for (const value of [null, undefined, NaN])
    assert.deepEqual([format.number(value), format.mm(value), format.pct(value)], ["–", "–", "–"]);
});

test("millimetres have as many digits as anybody can use, and a share says whether it is more or less", () => {
  assert.deepEqual([0.04, 0, 0.05, 9.96, 10, -12.6].map(format.mm), [
    "< 0.1",
    "0.0",
    "0.1",
    "10.0",
    "10",
    "−13",
  ]);
  assert.deepEqual([1.234, -1.234, 0.004].map(format.pct), ["+1.23", "−1.23", "0.00"]);
});

test("what a field names is called so in a sentence and as a title, also what an operator named", () => {
  assert.deepEqual(
    [format.lineName("halfway-line"), format.lineTitle("halfway-line")],
    ["halfway line", "Halfway line"],
  );
  assert.deepEqual(
    [format.lineName("my-own_line"), format.areaTitle("my-corner")],
    ["my own line", "My corner"],
  );
  assert.equal(format.inSentence("Left Half"), "left half");
});

test("a time is told from now, and after an hour by the clock", () => {
  const then = Date.UTC(2026, 10, 27, 6, 46);
  const ago = (ms) => format.ago(then, then + ms);
  assert.deepEqual(
    [ago(-5000), ago(400), ago(59_000), ago(150_000), ago(3_600_000)],
    ["just now", "just now", "59 s ago", "2 min ago", "at 06:46"],
  );
  assert.equal(format.dayAndTime("2026-11-27T06:46:00Z"), "27 Nov, 06:46");
});

test("a length that reads well is the next one below", () => {
  assert.deepEqual([0.3, 1, 4.9, 5, 99, 200].map(format.roundDown), [0.2, 1, 2, 5, 50, 200]);
});

test("a name too long for its place loses its middle, and one that fits nothing", () => {
  const { shortened } = format;
  assert.equal(shortened("East camera, tilted", 22), "East camera, tilted");
  assert.equal(shortened("Overhead camera, barrel lens", 22), "Overhead ca…arrel lens");
  assert.equal([...shortened("x".repeat(60), 22)].length, 22);
  assert.equal([...shortened("🎥".repeat(30), 22)].length, 22);
});
