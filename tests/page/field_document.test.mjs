// The field in the editor: read and sent unchanged, its markings switched, renamed and taken away.
import assert from "node:assert/strict";
import { test } from "node:test";
import * as fields from "../../static/features/fields/document.js";

const FIELD = {
  ...fields.blankField(),
  name: "lab",
  title: "Lab",
  extras: {
    marks: [
      { at: "centre", kind: "dot" },
      { at: "circle-top", kind: "cross" },
    ],
    note: "kept",
  },
};
const mark = (name, kind = "line") => ({ kind, name });

test("a field is sent as it was read, without what the server works out", () => {
  const told = {
    ...FIELD,
    own: true,
    statements: {},
    regions: { full: { ...FIELD.regions.full, borders: {} } },
  };
  const doc = fields.docOf(told);
  assert.deepEqual(doc, { ...FIELD, regions: { full: FIELD.regions.full } });
  assert.deepEqual(fields.sentOf(doc), doc);
});

test("a line that is off is not sent, keeps its place, and comes back as it was", () => {
  const off = fields.switched(FIELD, mark("goal-line-left"), false);
  assert.equal(fields.isOff(off, mark("goal-line-left")), true);
  assert.deepEqual(
    fields.sentOf(off).lines.map((l) => l.name),
    FIELD.lines.map((l) => l.name).filter((name) => name !== "goal-line-left"),
  );
  assert.deepEqual(fields.switched(off, mark("goal-line-left"), true), FIELD);
  assert.deepEqual(
    fields.sentOf(fields.switched(FIELD, mark("centre-circle", "arc"), false)).arcs,
    [],
  );
});

test("a landmark's new name is that of the dot painted at it, and its place in the order stays", () => {
  const renamed = fields.renamed(FIELD, mark("centre", "landmark"), "kick-off");
  assert.equal(Object.keys(renamed.landmarks)[0], "kick-off");
  assert.deepEqual(renamed.extras, {
    marks: [{ at: "kick-off", kind: "dot" }, FIELD.extras.marks[1]],
    note: "kept",
  });
  assert.deepEqual(fields.renamed(FIELD, mark("halfway-line"), "middle").lines[4].name, "middle");
  assert.equal(Object.keys(fields.renamed(FIELD, mark("full", "region"), "all").regions)[0], "all");
});

test("landmarks and parts are taken away with what is painted at them, lines are switched off", () => {
  const left = fields.without(FIELD, [
    mark("centre", "landmark"),
    mark("full", "region"),
    mark("halfway-line"),
  ]);
  assert.deepEqual(
    [left.landmarks.centre, left.regions.full, left.extras.marks.length],
    [undefined, undefined, 1],
  );
  assert.deepEqual(
    [left.lines.length, fields.isOff(left, mark("halfway-line"))],
    [FIELD.lines.length, true],
  );
});

test("numbers of a line, an arc and a part are changed, and of nothing else", () => {
  assert.equal(
    fields.withChanges(FIELD, mark("halfway-line"), { width_mm: 30 }).lines[4].width_mm,
    30,
  );
  assert.equal(
    fields.withChanges(FIELD, mark("centre-circle", "arc"), { radius_mm: 9 }).arcs[0].radius_mm,
    9,
  );
  assert.equal(
    fields.withChanges(FIELD, mark("full", "region"), { rotate: 90 }).regions.full.rotate,
    90,
  );
  assert.deepEqual(fields.withChanges(FIELD, mark("centre", "landmark"), { x: 1 }), FIELD);
});

test("what the server refuses is found at the mark it is of, though lines before it are off", () => {
  const off = fields.switched(FIELD, mark("touch-line-top"), false);
  for (const one of [
    mark("halfway-line"),
    mark("centre-circle", "arc"),
    mark("centre", "landmark"),
    mark("full", "region"),
  ])
    assert.deepEqual(fields.markOf(off, `${fields.entryOf(off, one)}.x`), one);
  assert.equal(fields.entryOf(off, mark("halfway-line")), "lines[3]");
  assert.deepEqual(
    ["title", "lines[99].from"].map((entry) => fields.markOf(FIELD, entry)),
    [null, null],
  );
});

test("a name is made of a title, and a new mark has the first that is free", () => {
  assert.deepEqual(
    ["Lab field", " Größe 3×2! ", "x".repeat(80)].map((title) => fields.nameOf(title).slice(0, 70)),
    ["lab-field", "gro-e-3-2", "x".repeat(64)],
  );
  const taken = {
    ...FIELD,
    lines: [{ name: "line-1" }],
    arcs: [{ name: "line-3" }],
    landmarks: { "line-2": [0, 0] },
  };
  assert.equal(fields.freeName(taken, "line"), "line-4");
});
