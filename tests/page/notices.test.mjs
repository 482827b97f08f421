// Notices: told once, left behind with the view once they could be read, and longer where something can be put back.
import assert from "node:assert/strict";
import { beforeEach, mock, test } from "node:test";
import { goTo } from "./window.mjs";
import "./features.mjs";
import { dismiss, help, notices, notify, notifyError } from "../../static/core/state.js";

const texts = () => notices.value.map(({ text }) => text);

beforeEach(() => {
  mock.timers.reset();
  mock.timers.enable({ apis: ["Date"], now: 1_000_000 });
  notices.value = [];
  goTo("#/cameras");
});

test("a notice outlives the view that it was made in as long as it takes to read it", () => {
  notify({ level: "warn", text: "Refused.", fix: "" });
  mock.timers.setTime(1_005_000);
  goTo("#/system/jobs");
  assert.deepEqual(texts(), ["Refused."]);
  mock.timers.setTime(1_060_000);
  assert.deepEqual(texts(), ["Refused."]); // nobody has left
  goTo("#/library/images");
  assert.deepEqual(texts(), []);
});

test("what was removed can be put back for minutes, wherever the operator has gone meanwhile", () => {
  notify({
    level: "info",
    text: "Removed.",
    fix: "",
    action: { label: "Put back", run: () => {} },
  });
  mock.timers.setTime(1_290_000);
  goTo("#/system/jobs");
  assert.deepEqual(texts(), ["Removed."]);
  mock.timers.setTime(1_310_000);
  goTo("#/cameras");
  assert.deepEqual(texts(), []);
});

test("another step of one picture is no other view: its notices and its help stay", () => {
  goTo("#/calibrate/abc/field");
  notify({ level: "warn", text: "Refused.", fix: "" });
  help.value = "manual";
  mock.timers.setTime(1_060_000);
  goTo("#/calibrate/abc/points");
  assert.deepEqual([texts(), help.value], [["Refused."], "manual"]);
  goTo("#/calibrate/def/points");
  assert.deepEqual([texts(), help.value], [[], ""]);
});

test("the same text is told once, as the last, and dismissed by its number", () => {
  for (const text of ["A", "B", "A"]) notify({ level: "warn", text, fix: "" });
  assert.deepEqual(texts(), ["B", "A"]);
  dismiss(notices.value[0].id);
  assert.deepEqual(texts(), ["A"]);
});

test("an error is told with its fix, and whoever must sign in is led there", () => {
  notifyError({ message: "The disk is full.", fix: "Make room.", status: 507 });
  notifyError({ message: "Sign in.", fix: "", status: 401 });
  notifyError(new Error("Nobody expected this."));
  const [full, sign, other] = notices.value;
  assert.deepEqual(
    [full.text, full.fix, full.action],
    ["The disk is full.", "Make room.", undefined],
  );
  assert.ok(sign.action.label);
  assert.ok(other.fix.length > 10);
});
