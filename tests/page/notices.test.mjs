// Notices: told once, left behind with the view once they could be read, and longer where something can be put back.
import assert from "node:assert/strict";
import { beforeEach, mock, test } from "node:test";
import { goTo } from "./window.mjs";
import "./features.mjs";
import { call, online } from "../../static/core/api.js";
import {
  cameras,
  dismiss,
  expireNotices,
  help,
  notices,
  notify,
  notifyError,
  renewNotices,
  retract,
} from "../../static/core/state.js";
import { activateCalibration } from "../../static/features/versions/activate.js";
import { importFile } from "../../static/features/versions/imports.js";

/** The server from now on: what it answers, or null where it is silent. */
const serve = (status, body = {}) => {
  globalThis.fetch = async () => {
    if (status === null) throw new TypeError("Failed to fetch");
    return new Response(JSON.stringify(body), { status });
  };
};
const asked = (...of) => call(...of).catch(notifyError);

const texts = () => notices.value.map(({ text }) => text);

beforeEach(() => {
  mock.timers.reset();
  mock.timers.enable({ apis: ["Date", "setTimeout", "setInterval"], now: 1_000_000 });
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

test("a newer notice about the same subject replaces the former, of whatever level", () => {
  const say = (text, about, level = "info") => notify({ level, text, fix: "", about });
  say("Version 1 is active.", "active/north");
  say("Version 2 is active.", "active/south");
  say("No file of that name.", "import", "warn");
  say("Version 2 is active now.", "active/north");
  say("Imported.", "import");
  assert.deepEqual(texts(), ["Version 2 is active.", "Version 2 is active now.", "Imported."]);
  retract("active/north", "warn");
  retract("import");
  assert.deepEqual(texts(), ["Version 2 is active.", "Version 2 is active now."]);
});

test("activate, undo, activate: one notice, of what is active now; another's activation removes it", async () => {
  const versions = ["a", "b", "a", "b"];
  cameras.value = [{ id: "north", name: "North", active_calibration: "b" }];
  serve(200, { items: [] });
  for (const id of versions)
    await activateCalibration({ id, version: id === "a" ? 1 : 2, camera: "north" });
  assert.equal(notices.value.length, 1);
  assert.match(texts()[0], /2.*North/);
  cameras.value = [{ ...cameras.value[0], active_calibration: "c" }];
  assert.deepEqual(texts(), []);
});

test("a refused activation is no longer said once the camera's version is active", async () => {
  cameras.value = [{ id: "north", name: "North", active_calibration: "b" }];
  serve(503, { detail: "The disk is full." });
  await activateCalibration({ id: "a", version: 1, camera: "north" });
  assert.deepEqual(texts(), ["The disk is full."]);
  serve(200, { items: [] });
  await activateCalibration({ id: "a", version: 1, camera: "north" });
  assert.equal(notices.value.length, 1);
  assert.match(texts()[0], /1.*North/);
});

test("a file that could not be read is no longer said once it is imported", async () => {
  const file = new File(["{}"], "a.json");
  serve(422, { detail: "It is no calibration." });
  await importFile(file);
  assert.deepEqual(texts(), ["a.json: It is no calibration."]);
  serve(201, { version: 3, camera: null, note: "" });
  await importFile(file);
  assert.deepEqual([notices.value.length, notices.value[0].level], [1, "info"]);
});

test("a refusal goes once the same request is answered, and no other", async () => {
  serve(409, { detail: "Refused." });
  await asked("PUT", "/drafts/1");
  serve(200);
  await asked("PUT", "/drafts/2");
  await asked("GET", "/drafts/1");
  assert.deepEqual(texts(), ["Refused."]);
  await asked("PUT", "/drafts/1?late=true");
  assert.deepEqual(texts(), []);
});

test("what a silent server made fail goes when it is back, with whatever subject", async () => {
  serve(null);
  await asked("GET", "/cameras");
  await call("POST", "/calibrations/a/activate").catch((e) => notifyError(e, "active/north"));
  assert.deepEqual([notices.value.length, online.value], [1, false]);
  serve(200);
  await call("GET", "/fields");
  assert.deepEqual(texts(), []);
});

test("information goes once it could be read, a warning stays, and what is being read begins again", () => {
  notify({ level: "info", text: "Removed.", fix: "" });
  notify({ level: "info", text: "Undo?", fix: "", action: { label: "Undo", run: () => {} } });
  notify({ level: "warn", text: "Refused.", fix: "" });
  mock.timers.setTime(1_009_000);
  expireNotices();
  assert.equal(notices.value.length, 3);
  renewNotices();
  mock.timers.setTime(1_018_000);
  expireNotices();
  assert.equal(notices.value.length, 3);
  mock.timers.setTime(1_020_000);
  expireNotices();
  assert.deepEqual(texts(), ["Undo?", "Refused."]);
  mock.timers.setTime(1_400_000);
  expireNotices();
  assert.deepEqual(texts(), ["Refused."]);
});
