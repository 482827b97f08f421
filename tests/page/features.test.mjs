// The features together: no name is taken twice, each view has an address and each tab its own rank and view.
import assert from "node:assert/strict";
import { test } from "node:test";
import "./features.mjs";
import { ACTIONS } from "../../static/core/actions.js";
import { VIEWS } from "../../static/core/features.js";
import { addressOf, route } from "../../static/core/route.js";
import { FEATURES } from "../../static/features/index.js";
import { tabsOf } from "../../static/features/shell/places.js";

const unique = (list) => assert.deepEqual(list, [...new Set(list)]);

test("no action, view, job or address is of two features", () => {
  unique(FEATURES.flatMap((it) => it.actions ?? []).map((action) => action.id));
  for (const part of ["views", "jobs"])
    unique(FEATURES.flatMap((it) => Object.keys(it[part] ?? {})));
  unique([...VIEWS.values()].flatMap((view) => view.addresses));
  assert.equal(ACTIONS.size, FEATURES.flatMap((it) => it.actions ?? []).length);
});

test("the page is where its address says as soon as the views are registered", () => {
  assert.equal(route.value.view, "wall");
});

test("each tab has a rank of its own, and a view without one says whose is shown", () => {
  for (const place of ["cameras", "field", "lenses", "library", "system"]) {
    unique([...VIEWS.values()].flatMap((view) => view.tabs?.[place] ?? []));
    assert.ok(
      tabsOf(place).every(([view, label]) => label && addressOf(view, { camera: "north" })),
      place,
    );
  }
  for (const [name, { behind }] of VIEWS) if (behind) assert.ok(VIEWS.get(behind)?.tabs, name);
});

test("of several actions with one key, those of one view go before those of calibrating", () => {
  const withKey = (key) =>
    [...ACTIONS.values()].filter((it) => it.keys?.includes(key)).map((it) => it.id);
  assert.deepEqual(withKey("ctrl+z"), ["field-undo", "undo-seeing", "take-roll", "undo"]);
  assert.deepEqual(withKey("Escape"), ["stop-picking", "escape"]);
});
