// What needs attention: what the server claims of the site, of images, jobs and the server, the worst first.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import "./features.mjs";
import { online } from "../../static/core/api.js";
import { cameras } from "../../static/core/state.js";
import { t } from "../../static/core/words.js";
import { jobs } from "../../static/features/jobs/job_list.js";
import { statuses } from "../../static/features/live/camera_status.js";
import { fetchHealth, health } from "../../static/features/settings/settings.js";
import {
  badCamera,
  problems,
  noProblem,
  summary,
  summaryOfPlace,
} from "../../static/features/shell/problems.js";
import { PLACES } from "../../static/features/shell/places.js";
import { readiness } from "../../static/features/shell/readiness.js";

const claim = (code, more = {}) => ({
  code,
  state: "refuted",
  gates: true,
  title: "It is so",
  evidence: "",
  fix: "",
  tried: [],
  figure: null,
  cure: "camera",
  camera: null,
  cases: [],
  ...more,
});
const of = (camera, text, fix = "") => ({ camera, text, fix });
const site = (...items) => {
  readiness.value = { gate: "problems", items };
};
const told = (...keys) => problems.value.map((it) => keys.map((key) => it[key]));

beforeEach(() => {
  online.value = true;
  cameras.value = ["east", "west"].map((id) => ({
    id,
    name: id.toUpperCase(),
    active_calibration: "abc",
    active: {},
  }));
  statuses.value = {};
  jobs.value = [];
  health.value = readiness.value = null;
});

test("where all is well or not tested there is no problem", () => {
  site(
    claim("cameras-live", { state: "held" }),
    claim("rig-hall", { state: "not-tested", gates: false }),
    claim("publishing", { gates: false, title: "Not publishing" }),
  );
  assert.deepEqual([problems.value, badCamera.value, summary.value.level], [[], null, "ok"]);
});

test("nothing is called good before the server has said what it knows", () => {
  assert.deepEqual([problems.value, summary.value.level], [[], "unknown"]);
  assert.equal(noProblem.value, "Waiting for the server…");
});

test("each case of a claim that stands against a match is told with its fix and its place", () => {
  site(
    claim("cameras-live", {
      cases: [of("east", "EAST: No file.", "Bring it."), of("west", "WEST: Stalled.")],
    }),
  );
  assert.deepEqual(problems.value[0], {
    id: "cameras-live-east",
    level: "bad",
    place: "cameras",
    camera: "east",
    text: "EAST: No file.",
    fix: "Bring it.",
    href: "#/cameras/east/live",
  });
  assert.deepEqual(told("id"), [["cameras-live-east"], ["cameras-live-west"]]);
  assert.deepEqual(badCamera.value, { name: "EAST", href: "#/cameras/east/live" });
});

test("a claim without cases is told in one sentence, and a camera that is not calibrated yet is work to do", () => {
  site(
    claim("cameras-calibrated", {
      cure: "images",
      camera: "west",
      title: "1 of 2 calibrated",
      evidence: "Not: W.",
    }),
    claim("rig-hall", { cure: "rig", title: "Cameras do not agree", evidence: "" }),
  );
  assert.deepEqual(told("level", "place", "text", "href"), [
    ["bad", "field", "Cameras do not agree.", "#/field/rigs/hall"],
    ["warn", "cameras", "1 of 2 calibrated. Not: W.", "#/cameras/west/calibrate"],
  ]);
  assert.equal(badCamera.value, null);
});

test("who is no longer signed in keeps what the server's health has said", async () => {
  const whole = { status: "ok", version: "1", uptime_s: 2, warnings: [], damaged: [] };
  for (const answer of [whole, { status: "ok" }]) {
    globalThis.fetch = async () => new Response(JSON.stringify(answer));
    await fetchHealth();
    assert.deepEqual(health.value, whole);
  }
});

test("cases of a claim that does not stand against a match are warnings", () => {
  site(claim("rig-hall", { gates: false, cure: "rig", cases: [of(null, "A.", "B.")] }));
  assert.deepEqual(told("level", "place", "text", "fix", "href"), [
    ["warn", "field", "A.", "B.", "#/field/rigs/hall"],
  ]);
});

test("what the server's health says as well is told once", () => {
  health.value = {
    warnings: [{ reason: "publishing", text: "No interface.", fix: "Choose." }],
    damaged: [],
  };
  site(claim("publishing", { cure: "publishing", cases: [of(null, "No interface.", "Choose.")] }));
  assert.deepEqual(told("level", "place", "href"), [["bad", "system", "#/system/publishing"]]);
});

test("a silent server is one problem, whatever it said before", () => {
  site(claim("cameras-live", { cases: [of("east", "EAST: No file.")] }));
  online.value = false;
  assert.deepEqual(told("id", "text"), [["away", t("common.server-silent")]]);
});

test("bad light is a warning, after what stops a match", () => {
  const words = [
    { severity: "warning", text: "Dark.", fix: "Light." },
    { severity: "info", text: "Fine.", fix: "" },
  ];
  statuses.value = { east: { words } };
  site(claim("cameras-in-place", { cure: "drift", cases: [of("west", "WEST: Moved.")] }));
  assert.deepEqual(told("level", "text", "href"), [
    ["bad", "WEST: Moved.", "#/cameras/west/drift"],
    ["warn", "EAST: Dark.", "#/cameras/east/live"],
  ]);
  assert.deepEqual([summary.value.count, summary.value.level], [2, "bad"]);
});

test("the bell, the status bar and the rail count the same problems, however many and of whatever kind", () => {
  const east = of("east", "EAST: No file."),
    kinds = [
      [0, "ok", () => {}],
      [1, "bad", () => site(claim("cameras-live", { cases: [east] }))],
      [1, "bad", () => void (online.value = false)],
      [
        1,
        "warn",
        () => void (health.value = { warnings: [{ reason: "disk", text: "Full.", fix: "" }] }),
      ],
      [
        3,
        "bad",
        () => {
          site(
            claim("cameras-live", { cases: [east] }),
            claim("rig-hall", { cure: "rig", cases: [of(null, "Apart.")] }),
          );
          jobs.value = [{ state: "failed", ended_at: new Date().toISOString() }];
        },
      ],
    ];
  for (const [count, level, arise] of kinds) {
    online.value = true;
    site();
    health.value = null;
    arise();
    const { worst, ...all } = summary.value,
      places = PLACES.map(({ place }) => summaryOfPlace(place));
    assert.deepEqual(all, { count, level });
    assert.equal(worst, problems.value[0] ?? null);
    assert.equal(
      places.reduce((sum, it) => sum + it.count, 0),
      count,
    );
    assert.equal(places.map((it) => it.level).find((it) => it === level) ?? "ok", level);
  }
});

test("work that failed lately is a warning, older failures are history", () => {
  const failed = (minutes) => ({
    state: "failed",
    ended_at: new Date(Date.now() - 60_000 * minutes).toISOString(),
  });
  jobs.value = [
    failed(5),
    failed(50),
    failed(70),
    { state: "done", ended_at: new Date().toISOString() },
  ];
  assert.deepEqual(told("id", "level", "href", "text"), [
    ["jobs", "warn", "#/system/jobs", t("shell.problem.jobs-failed", { count: 2 })],
  ]);
});

test("damage of the server's records goes before its warnings, what was set aside says where it is", () => {
  const damage = (file, note) => ({ kind: "lens", file, note, fix: "Restore." });
  health.value = {
    warnings: [{ reason: "disk", text: "Full.", fix: "Make room." }],
    damaged: [damage("lenses/1", null), damage("old.db", "In quarantine.")],
  };
  assert.deepEqual(told("id", "level", "fix"), [
    ["damaged-lenses/1", "bad", "Restore."],
    ["damaged-old.db", "bad", "In quarantine."],
    ["disk", "warn", "Make room."],
  ]);
  assert.equal(problems.value[1].text, t("shell.problem.set-aside", { file: "old.db" }));
});
