// What needs attention: of cameras, fields, publishing, rigs, jobs and the server, the worst first.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { online } from "../../static/core/api.js";
import { cameras } from "../../static/core/state.js";
import { t } from "../../static/core/words.js";
import { jobs } from "../../static/features/jobs/job_list.js";
import { SERVER_GONE, statuses } from "../../static/features/live/camera_status.js";
import { publishing, receivedGeometry } from "../../static/features/network/network.js";
import { rigs } from "../../static/features/rig/rig.js";
import { health } from "../../static/features/settings/settings.js";
import { badCamera, isBroken, problems, worstOf } from "../../static/features/shell/problems.js";

const camera = (id, changes = []) => ({ id, name: id.toUpperCase(), active_calibration: "abc",
  active: { field_changes: changes } });
const status = (state, more = {}) => ({ state, problem: null, drift: null, words: [], ...more });
const ids = () => problems.value.map(({ id }) => id);
const first = () => problems.value[0];

beforeEach(() => {
  online.value = true;
  cameras.value = [camera("east"), camera("west")];
  statuses.value = { east: status("live"), west: status("idle") };
  jobs.value = rigs.value = [];
  publishing.value = receivedGeometry.value = health.value = null;
});

test("where all is well there is no problem", () => {
  assert.deepEqual([problems.value, badCamera.value, worstOf(() => true)], [[], null, null]);
});

test("a camera that gives nothing is told with its fix and its place, one that only starts is not", () => {
  const gone = status("offline", { problem: { reason: "no-file", what: "No file.", fix: "Bring it." } });
  statuses.value = { east: gone, west: status("connecting") };
  assert.deepEqual(problems.value, [{ id: "camera-east", level: "bad", place: "cameras", camera: "east",
    text: "EAST: No file.", fix: "Bring it.", href: "#/cameras/east/live" }]);
  assert.deepEqual(badCamera.value, { name: "EAST", href: "#/cameras/east/live" });
  assert.deepEqual(["east", "west", "north"].map(isBroken), [true, false, false]);
  statuses.value = { east: status("stalled"), west: status("mismatch") };
  assert.deepEqual(ids(), ["camera-east", "camera-west"]);
});

test("a silent server is one problem, not one of each camera", () => {
  online.value = false;
  const gone = status("offline", { problem: { reason: SERVER_GONE, what: "Silent.", fix: "" } });
  statuses.value = { east: gone, west: gone };
  assert.deepEqual(ids(), ["away"]);
});

test("a camera that has moved leads to where it is mended, and goes before bad light, which is a warning", () => {
  const words = [{ severity: "warning", text: "Dark.", fix: "Light." }, { severity: "info", text: "Fine.", fix: "" }];
  statuses.value = { east: status("live", { words }),
    west: status("live", { words, drift: { alarm: true, sentence: "Moved.", fix: "Update." } }) };
  assert.deepEqual(problems.value.map(({ id, level, href }) => [id, level, href]), [
    ["drift-west", "bad", "#/cameras/west/drift"], ["light-east-Dark.", "warn", "#/cameras/east/live"]]);
  assert.equal(worstOf((it) => it.camera === "east"), "warn");
});

test("a calibration that a change of its field made wrong leads to the versions", () => {
  cameras.value = [camera("east", ["centre-line", "centre-circle", "left", "right"])];
  assert.deepEqual([first().id, first().href], ["field-east", "#/cameras/east/versions"]);
  assert.ok(first().text.includes("centre line") && first().text.includes("EAST"));
});

test("two cameras of one number over one field are told once, over another field they are not", () => {
  const sent = (id, camera_id, field = "lab") => ({ camera: id, camera_id, field });
  publishing.value = { problem: null, cameras: [sent("east", 0), sent("west", 0), sent("north", 0, "other")] };
  assert.deepEqual(problems.value.map(({ id, level }) => [id, level]), [["number-0", "warn"]]);
  assert.ok(first().text.includes("EAST") && first().text.includes("WEST") && !first().text.includes("north"));
  publishing.value = { problem: { what: "No interface.", fix: "Choose." }, cameras: [sent("east", 0), sent("west", 1)] };
  assert.deepEqual(problems.value.map(({ id, text, fix }) => [id, text, fix]), [["publishing", "No interface.", "Choose."]]);
});

test("who else publishes a camera of ours otherwise is told, who agrees is not", () => {
  publishing.value = { problem: null, cameras: [] };
  const heard = (camera_id, contradicts) => ({ camera_id, contradicts });
  receivedGeometry.value = { items: [{ id: "s1", address: "10.0.0.7", cameras: [heard(0, true), heard(1, false)] }] };
  assert.deepEqual(ids(), ["contradiction-s1-0"]);
  assert.ok(first().text.includes("10.0.0.7"));
});

test("troubles of a rig and work that failed lately are warnings, older failures are history", () => {
  rigs.value = [{ name: "hall", cameras: [{ camera: "east", troubles: [{ reason: "rectangles", text: "A.", fix: "B." }] }] }];
  const failed = (minutes) => ({ state: "failed", ended_at: new Date(Date.now() - 60_000 * minutes).toISOString() });
  jobs.value = [failed(5), failed(50), failed(70), { state: "done", ended_at: new Date().toISOString() }];
  assert.deepEqual(problems.value.map(({ id, level, href }) => [id, level, href]),
    [["rig-hall-east-rectangles", "warn", "#/field/rigs/hall"], ["jobs", "warn", "#/system/jobs"]]);
  assert.equal(problems.value[1].text, t("shell.problem.jobs-failed", { count: 2 }));
});

test("damage of the server's records goes before its warnings, what was set aside says where it is", () => {
  const damage = (file, note) => ({ kind: "lens", file, note, fix: "Restore." });
  health.value = { warnings: [{ reason: "disk", text: "Full.", fix: "Make room." }],
    damaged: [damage("lenses/1", null), damage("old.db", "In quarantine.")] };
  assert.deepEqual(problems.value.map(({ id, level, fix }) => [id, level, fix]), [["damaged-lenses/1", "bad", "Restore."],
    ["damaged-old.db", "bad", "In quarantine."], ["disk", "warn", "Make room."]]);
  assert.equal(problems.value[1].text, t("shell.problem.set-aside", { file: "old.db" }));
});
