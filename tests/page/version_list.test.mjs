// The versions of a camera: which one it can go back to.
import assert from "node:assert/strict";
import { test } from "node:test";
import {
  activeVersion,
  formerVersion,
  versionList,
} from "../../static/features/versions/version_list.js";

const list = (history, active = "c") => {
  versionList.value = {
    camera: "east",
    next: null,
    items: ["a", "b", "c"].map((id) => ({ id, active: id === active })),
    history,
  };
};
const activation = (calibration, version) => ({ calibration, version });

test("the way back leads to the version that was active before the present one", () => {
  list([activation("c", 3), activation("b", 2), activation("a", 1)]);
  assert.deepEqual([activeVersion.value.id, formerVersion.value.calibration], ["c", "b"]);
  list([activation("c", 3), activation("c", 3)]);
  assert.equal(formerVersion.value, null);
  list([activation("b", 2)], "");
  assert.equal(formerVersion.value, null);
});

test("a version that was deleted is passed over on the way back", () => {
  list([activation("c", 3), activation("x", null), activation("a", 1)]);
  assert.equal(formerVersion.value.calibration, "a");
  list([activation("c", 3), activation("x", null)]);
  assert.equal(formerVersion.value, null);
});
