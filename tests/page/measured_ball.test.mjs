// The ball model of rolls goes to the publication in which the camera is, and leaves what was not measured.
import assert from "node:assert/strict";
import { test } from "node:test";
import { notices } from "../../static/core/state.js";
import { publishDeceleration } from "../../static/features/league/measured_ball.js";

const chip = { damping_z: 0.5 };
const measured = (value) => ({ value, sigma: 0.01, rolls: 9 });

/** Publications by their rig, and what was sent to them. */
function serve(publications) {
  const sent = [];
  notices.value = [];
  globalThis.fetch = async (path, { method, headers, body }) => {
    const rig = new URL(path, "http://127.0.0.1").searchParams.get("rig") ?? "";
    if (method === "PUT") sent.push([rig, headers["If-Match"], JSON.parse(body)]);
    return new Response(JSON.stringify(publications[rig]), {
      headers: { "Content-Type": "application/json", ETag: `"${rig}1"` },
    });
  };
  return sent;
}

const rigs = [
  { name: "b", separate: true },
  { name: "c", separate: false },
];

test("what rolls do not tell stays as it was entered, in the rig of the camera", async () => {
  const entered = { acc_slide: -3, acc_roll: -0.4, k_switch: 0.6 };
  const sent = serve({
    "": { members: ["north"], rigs, ball_models: null },
    b: {
      members: ["south"],
      rigs,
      ball_models: { straight_two_phase: entered, chip_fixed_loss: chip },
    },
  });
  await publishDeceleration("south", {
    acc_roll: measured(-0.28126),
    acc_slide: null,
    k_switch: null,
    sentence: "",
  });
  const wanted = { acc_slide: -3, acc_roll: -0.2813, k_switch: 0.6 };
  assert.deepEqual(sent, [
    ["b", '"b1"', { ball_models: { straight_two_phase: wanted, chip_fixed_loss: chip } }],
  ]);
  assert.equal(notices.value[0].level, "info");
});

test("nothing is sent while a value is missing, and the notice says which", async () => {
  const sent = serve({ "": { members: ["north"], rigs, ball_models: null } });
  await publishDeceleration("north", {
    acc_roll: measured(-0.28),
    acc_slide: null,
    k_switch: null,
    sentence: "",
  });
  assert.deepEqual(sent, []);
  assert.equal(notices.value[0].level, "warn");
  assert.match(notices.value[0].text, /Sliding.*, .*factor/i);
  assert.doesNotMatch(notices.value[0].text, /Rolling/);
});
