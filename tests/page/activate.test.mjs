// Activating a version: what the server holds against it is asked about, and a decision is about what was seen then.
import assert from "node:assert/strict";
import { mock, test } from "node:test";
import { cameras, notices } from "../../static/core/state.js";
import {
  activateCalibration,
  answerWarning,
  warning,
} from "../../static/features/versions/activate.js";

mock.timers.enable({ apis: ["setTimeout"] }); // the page asks again and again how the cameras are

const version = { id: "c", version: 3, camera: "north" };
const claims = [{ code: "accuracy", state: "refuted" }];
const reply = (status, body) =>
  new Response(JSON.stringify(body), {
    status,
    headers: { "Content-Type": status < 400 ? "application/json" : "application/problem+json" },
  });

/** A server with version `active` of the camera, and a problem of every other one. */
function serve(active) {
  const site = { active, asked: [] };
  globalThis.fetch = async (path, { method, headers, body }) => {
    if (method === "GET")
      return reply(200, { items: [{ id: "north", active_calibration: site.active }] });
    const { despite } = JSON.parse(body);
    site.asked.push([headers["If-Match"], ...despite]);
    if (!despite.includes("accuracy"))
      return reply(409, { detail: "Problems", claims, despite: ["accuracy"] });
    if (headers["If-Match"] !== site.active)
      return reply(412, { detail: "Grace was faster", fix: "" });
    site.active = path.split("/").at(-2);
    return reply(200, {});
  };
  cameras.value = [{ id: "north", name: "North", active_calibration: active }];
  notices.value = [];
  return site;
}

const question = async () => {
  while (!warning.value) await new Promise(setImmediate);
  return warning.value;
};

test("what is answered with no is not activated", async () => {
  const site = serve("a"),
    done = activateCalibration(version),
    asked = await question();
  assert.deepEqual(asked.claims, claims);
  answerWarning(asked, false);
  assert.deepEqual([await done, site.active, warning.value], [false, "a", null]);
});

test("a version that somebody else activates while the question is open is reported, not replaced", async () => {
  const site = serve("a"),
    done = activateCalibration(version),
    asked = await question();
  site.active = "b";
  cameras.value = [{ ...cameras.value[0], active_calibration: "b" }]; // the page hears of it
  answerWarning(asked, true);
  assert.deepEqual([await done, site.active], [false, "b"]);
  const { text, action } = notices.value.at(-1);
  assert.equal(text, "Grace was faster");

  action.run(); // in spite of that too: the problems were accepted
  while (site.active === "b") await new Promise(setImmediate);
  assert.deepEqual([site.active, warning.value], ["c", null]);
  assert.deepEqual(site.asked, [["a"], ["a", "accuracy"], ["b", "accuracy"]]);
});
