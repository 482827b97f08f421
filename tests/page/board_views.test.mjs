// What a report of a board says of each picture: found by its place in the search, whatever its view is called.
import assert from "node:assert/strict";
import { test } from "node:test";
import { foundLens, viewReport } from "../../static/features/boards/board.js";

test("a picture has its own view, and the reason why it has none", () => {
  const warnings = [
      { reason: "noisy-corners" },
      { reason: "no-board", index: 1, text: "No", fix: "board." },
    ],
    views = [{ name: "shelf 3" }, { name: "desk", text: "Left out." }];
  foundLens.value = { snapshots: ["a", "b", "c"], report: { warnings, views } };
  const said = ["a", "b", "c", "d"]
    .map((id) => viewReport({ id }))
    .map((seen) => seen && [seen.view?.name, seen.why]);
  assert.deepEqual(said, [["shelf 3", ""], [undefined, "No board."], ["desk", "Left out."], null]);
});
