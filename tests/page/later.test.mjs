// A part of the page that is loaded when it is first drawn.
import assert from "node:assert/strict";
import { test } from "node:test";
import "./window.mjs";
import "./features.mjs";
import { notices } from "../../static/core/state.js";
import { later } from "../../static/ui/later.js";

const settled = () => new Promise((resolve) => setImmediate(resolve));

test("it is loaded once; until then, and without the server, what waits is drawn and one notice says why", async () => {
  let asked = 0;
  const Shown = () => "shown",
    load = async () => {
      asked += 1;
      if (asked < 3) throw new TypeError("Failed to fetch dynamically imported module");
      return Shown;
    },
    Part = later(load, ({ height }) => height);
  for (const times of [1, 2]) {
    assert.deepEqual([Part({ height: 40 }), Part({ height: 40 }), asked], [40, 40, times]);
    await settled();
    assert.deepEqual(
      notices.value.map(({ text }) => text),
      ["This part of the page could not be loaded."],
    );
  }
  assert.equal(Part({ height: 40 }), 40);
  await settled();
  assert.equal(Part({ height: 40 }).type, Shown);
  assert.deepEqual([asked, notices.value], [3, []]);
});
