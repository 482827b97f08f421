// Every refusal and warning of the points has a button that leads out, and another area is chosen by one press.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { EMPTY, doc, load } from "../../static/core/document.js";
import { route } from "../../static/core/route.js";
import { cameras, fields, models, snapshot } from "../../static/core/state.js";
import { autoDetect } from "../../static/features/automatic/find_lines.js";
import { preview } from "../../static/features/calibrate/fitting.js";
import { isOffArea } from "../../static/features/calibrate/field_sides.js";
import { FIXES, fixesOf } from "../../static/features/calibrate/warning_fixes.js";
import { goTo } from "./window.mjs";
import "./features.mjs";

const region = (name, x) => ({ name, x, y: [-100, 100], rotate: 0 });
const FIELD = {
  name: "lab",
  lines: [
    { name: "halfway-line", from: [0, -100], to: [0, 100] },
    { name: "west-line", from: [-90, -50], to: [-90, 50] },
  ],
  arcs: [{ name: "centre-circle", centre: [0, 0], radius_mm: 20, start_deg: 0, end_deg: 360 }],
  regions: { full: region("full", [-150, 150]), east: region("east", [0, 150]) },
  landmarks: { spot: [-60, 0] },
};
const OF_OTHER_MODELS = new Set(["height-unknown", "weakly-determined"]); // those have the option that is offered
const CLICKED = {
  feature: "left",
  kind: "line",
  points: [
    [80, 300],
    [80, 100],
  ],
};

beforeEach(() => {
  fields.value = [FIELD];
  cameras.value = [];
  models.value = [];
  snapshot.value = { id: "a", width: 640, height: 480 };
  autoDetect.value = true;
  preview.value = {
    report: {
      areas: [{ region: "east", rotate: 90, seen_share: 1 }],
      warnings: [],
      next_click: null,
    },
  };
  load({ ...EMPTY, field: "lab", region: "full", observations: [CLICKED] });
  goTo("#/calibrate/a/points");
});

test("every reason has a button, without a camera and with a model that has no options", () => {
  assert.ok(Object.keys(FIXES).length > 30);
  for (const reason of Object.keys(FIXES).filter((name) => !OF_OTHER_MODELS.has(name)))
    assert.notEqual(fixesOf({ reason, feature: "left", index: 0 }).length, 0, reason);
});

test("an area that the image shows is chosen with its rotation, and points are shown", () => {
  load({ ...doc.value, observations: [] });
  const [fix] = fixesOf({ reason: "area-not-in-image" });
  assert.match(fix.label, /east/i);
  fix.run();
  assert.deepEqual(
    [doc.value.region, doc.value.rotate, route.value.picture, route.value.step],
    ["east", 90, "a", "points"],
  );
});

test("a clicked line without a part in the area is marked", () => {
  assert.deepEqual(
    ["halfway-line", "west-line", "centre-circle", "spot", "left"].map(isOffArea),
    Array(5).fill(false),
  );
  load({ ...doc.value, region: "east" });
  assert.deepEqual(["halfway-line", "west-line", "centre-circle", "spot", "left"].map(isOffArea), [
    false,
    true,
    false,
    true,
    false,
  ]);
});
