// What an image is recognised as goes into the document; what the operator does meanwhile stands above it.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { EMPTY, change, doc, load, undo } from "../../static/core/document.js";
import { fields, snapshot } from "../../static/core/state.js";
import {
  fieldChoices,
  findLines,
  lastFound,
  useChoice,
} from "../../static/features/automatic/find_lines.js";
import { offered } from "../../static/features/calibrate/line_suggestions.js";
import { nextAction } from "../../static/features/shell/steps.js";
import { t } from "../../static/core/words.js";
import { goTo } from "./window.mjs";
import "./features.mjs";

const region = (name, rotate) => ({ name, x: [0, 100], y: [0, 100], rotate });
const FIELD = {
  name: "lab",
  title: "Lab",
  lines: [],
  arcs: [],
  landmarks: {},
  regions: { full: region("full", 0), half: region("half", 90) },
};
const LINE = {
  feature: "left",
  kind: "line",
  points: [
    [10, 10],
    [10, 90],
  ],
};
const choice = (area, rotate) => ({
  field: "lab",
  title: "Lab",
  region: area,
  rotate,
  seen_share: 1,
});

let asked = [];
/** A server that answers so. */
const serve = (level, choices, observations) => {
  globalThis.fetch = async (_path, { body }) => {
    asked.push(JSON.parse(body));
    return new Response(
      JSON.stringify({
        verdict: { level, sentence: "", fix: "", reason: "" },
        areas: [],
        observations,
        recognised: { choices },
      }),
      { headers: { "Content-Type": "application/json" } },
    );
  };
};
const place = () => [
  doc.value.field,
  doc.value.region,
  doc.value.rotate,
  doc.value.observations.length,
];

beforeEach(() => {
  asked = [];
  fields.value = [FIELD];
  snapshot.value = { id: crypto.randomUUID(), width: 640, height: 480 };
  load(EMPTY);
  goTo(`#/calibrate/${snapshot.value.id}/field`);
});

test("a field that is recognised surely is one change, with its points", async () => {
  serve("good", [choice("half", 90)], [LINE]);
  assert.equal(await findLines(), true);
  assert.deepEqual(
    [asked[0].field, asked[0].region, asked[0].rotate, asked[0].keep],
    ["auto", "auto", undefined, false],
  );
  assert.deepEqual(place(), ["lab", "half", null, 1]); // its rotation is the area's own
  undo();
  assert.deepEqual([...place(), lastFound.value], [null, null, null, 0, null]);
});

test("of an unsure one, the points are offered", async () => {
  serve("unsure", [choice("half", 270)], [LINE]);
  assert.equal(await findLines(), false);
  assert.deepEqual([...place(), offered.value.length], ["lab", "half", 270, 0, 1]);
});

test("of several, none is chosen and nothing goes on, until the operator chooses", async () => {
  serve("nothing", [choice("half", 90), choice("half", 270)], []);
  await findLines();
  assert.deepEqual([...place(), fieldChoices.value.length], [null, null, null, 0, 2]);
  assert.equal(nextAction.value.label, t("shell.next.choose-field"));
  assert.notEqual(nextAction.value.missing, "");
  serve("good", [], [LINE]);
  goTo(`#/calibrate/${snapshot.value.id}/points`); // saved only from where it was chosen
  await useChoice(fieldChoices.value[1]);
  assert.deepEqual(place(), ["lab", "half", 270, 1]);
  assert.deepEqual(
    [asked.length, asked[1].field, asked[1].region, asked[1].rotate],
    [2, "lab", "half", 270],
  );
});

test("of an image without a known field, nothing is chosen", async () => {
  serve("nothing", [], []);
  await findLines();
  assert.deepEqual([...place(), fieldChoices.value.length], [null, null, null, 0, 0]);
  assert.equal(nextAction.value.label, t("shell.next.choose-field"));
});

for (const [what, deed] of Object.entries({
  "a field that is chosen": { field: "lab", region: "full" },
  "a point that is marked": { observations: [{ ...LINE, points: [[1, 1]] }] },
}))
  test(`${what} meanwhile stays, and the answer is dropped`, async () => {
    serve("good", [choice("half", 90)], [LINE]);
    const done = findLines();
    change({ ...doc.value, ...deed });
    const now = doc.value;
    assert.equal(await done, false);
    assert.deepEqual([doc.value, lastFound.value], [now, null]);
  });

test("with the field known, points that are marked meanwhile stay beside the detected ones", async () => {
  load({ ...EMPTY, field: "lab", region: "full" });
  serve("good", [], [LINE, { ...LINE, feature: "right" }]);
  const done = findLines(),
    marked = { ...LINE, points: [[1, 1]] };
  change({ ...doc.value, observations: [marked] });
  assert.equal(await done, true);
  assert.deepEqual(
    doc.value.observations.map((o) => o.feature),
    ["left", "right"],
  );
  assert.deepEqual(doc.value.observations[0], marked);
});
