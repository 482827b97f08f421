// Detected points go with the field, the area and the rotation they were detected for; what the operator did stays.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { EMPTY, doc, load, undo } from "../../static/core/document.js";
import { fields, snapshot } from "../../static/core/state.js";
import {
  rememberDetected,
  withoutDetected,
} from "../../static/features/automatic/detected_points.js";
import { changePlace } from "../../static/features/automatic/find_lines.js";

const line = (feature, ...points) => ({ feature, kind: "line", points });
const CLICKED = line("left", [80, 300], [80, 100]),
  FOUND = line("top", [400, 60], [100, 60.25]);

beforeEach(() => {
  localStorage.setItem("touchline.detected", "[]");
  fields.value = [];
  snapshot.value = { id: "a", width: 640, height: 480 };
  load({ ...EMPTY, field: "lab", region: "full", observations: [CLICKED, FOUND] });
});

test("detected points go with the area, and come back by one undo", () => {
  rememberDetected("a", [FOUND]);
  changePlace({ region: "half", rotate: null });
  assert.deepEqual([doc.value.region, doc.value.observations], ["half", [CLICKED]]);
  undo();
  assert.deepEqual([doc.value.region, doc.value.observations], ["full", [CLICKED, FOUND]]);
});

test("points that the operator has moved, added to or clicked are the operator's", () => {
  rememberDetected("a", [FOUND]);
  for (const touched of [
    line("top", [400, 61], [100, 60.25]),
    line("top", [400, 60], [100, 60.25], [250, 60]),
  ])
    assert.deepEqual(withoutDetected("a", [CLICKED, touched]), [CLICKED, touched]);
  assert.deepEqual(withoutDetected("b", [FOUND]), [FOUND]); // another picture
  assert.deepEqual(withoutDetected(undefined, [FOUND]), [FOUND]);
  localStorage.setItem("touchline.detected", "{");
  assert.deepEqual(withoutDetected("a", [FOUND]), [FOUND]);
});

test("the newest detection of a picture counts, and so many pictures are known", () => {
  rememberDetected("a", [FOUND]);
  rememberDetected("a", [line("bottom", [1, 2])]);
  assert.deepEqual(withoutDetected("a", [FOUND]), [FOUND]);
  for (let n = 0; n < 20; n++) rememberDetected(`p${n}`, [FOUND]);
  assert.deepEqual(withoutDetected("p0", [FOUND]), []);
  assert.deepEqual(withoutDetected("a", [line("bottom", [1, 2])]).length, 1);
});
