// Addresses: each view has its own, former ones are replaced by the present ones, and what is no address says so.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { goTo } from "./window.mjs";
import "./features.mjs";
import { isUnfolded } from "../../static/core/folds.js";
import { manualPage, openManual } from "../../static/core/manual.js";
import { redirected } from "../../static/core/redirects.js";
import { addressOf, go, goInstead, goToStep, route } from "../../static/core/route.js";

const PICTURE = "0123456789abcdef";
/** A view and its words, by its address. */
const VIEWS = {
  "#/cameras": ["wall"],
  "#/cameras/new": ["new-camera"],
  "#/cameras/overhead/live": ["live", { camera: "overhead" }],
  "#/cameras/overhead/calibrate": ["camera-images", { camera: "overhead" }],
  "#/cameras/overhead/drift": ["drift", { camera: "overhead" }],
  "#/cameras/overhead/detection": ["detection", { camera: "overhead" }],
  "#/cameras/overhead/settings": ["camera-form", { camera: "overhead" }],
  "#/cameras/overhead/versions": ["versions", { camera: "overhead" }],
  "#/cameras/my%20camera%2F2/live": ["live", { camera: "my camera/2" }],
  [`#/calibrate/${PICTURE}/points`]: ["calibrate", { picture: PICTURE, step: "points" }],
  "#/field": ["field"],
  "#/field/fields/lab": ["field-editor", { field: "lab" }],
  "#/field/new-field": ["new-field"],
  "#/field/new-field/ssl-div-b": ["new-field", { field: "ssl-div-b" }],
  "#/field/new": ["new-rig"],
  "#/field/new/ssl-div-b": ["new-rig", { field: "ssl-div-b" }],
  "#/field/rigs/above": ["rig", { rig: "above" }],
  "#/field/rigs/above/north/south": ["match", { rig: "above", left: "north", right: "south" }],
  "#/field/pairs/1a/2b": ["former-pair", { left: "1a", right: "2b" }],
  "#/field/scene": ["scene"],
  "#/field/scene/rig/above": ["scene", { scene: "rig/above" }],
  "#/lenses": ["lenses"],
  "#/lenses/board": ["board"],
  "#/lenses/board/overhead": ["capture", { camera: "overhead" }],
  "#/lenses/edges": ["edges"],
  "#/lenses/ball/overhead": ["ball", { camera: "overhead" }],
  "#/library/images": ["images"],
  "#/library/versions": ["versions"],
  "#/library/import": ["import"],
  "#/system/publishing": ["publishing"],
  "#/system/jobs": ["jobs"],
  "#/system/server": ["server"],
};
/** Former addresses, and where they lead now. */
const FORMER = {
  "": "#/cameras",
  "#/": "#/cameras",
  "#/live/overhead": "#/cameras/overhead/live",
  "#/live/new camera": "#/cameras/new",
  "#/seeing/overhead": "#/cameras/overhead/detection",
  "#/versions/overhead": "#/cameras/overhead/versions",
  "#/versions": "#/library/versions",
  "#/library/fields": "#/field",
  "#/library/fields/lab": "#/field/fields/lab",
  "#/library/new-field": "#/field/new-field",
  "#/library/new-field/ssl-div-b": "#/field/new-field/ssl-div-b",
  "#/library": "#/library/images",
  "#/cameras/overhead": "#/cameras/overhead/live",
  "#/system": "#/system/publishing",
  "#/rig": "#/field/new",
  "#/rig/above": "#/field/rigs/above",
  "#/field/rigs": "#/field",
  "#/field/pairs": "#/field",
  "#/pair": "#/field",
  "#/pair/1a/2b": "#/field/pairs/1a/2b",
  "#/scene": "#/field/scene",
  "#/scene/rig/above": "#/field/scene/rig/above",
  "#/lens": "#/lenses/board",
  "#/capture/overhead": "#/lenses/board/overhead",
  "#/straight": "#/lenses/edges",
  "#/rolls/overhead": "#/lenses/ball/overhead",
  "#/jobs": "#/system/jobs",
  "#/settings": "#/system/server",
  [`#/${PICTURE}`]: `#/calibrate/${PICTURE}/field`,
  [`#/${PICTURE}/picture`]: `#/calibrate/${PICTURE}/field`,
  [`#/${PICTURE}/borders`]: `#/calibrate/${PICTURE}/points`,
  [`#/${PICTURE}/model`]: `#/calibrate/${PICTURE}/points`,
  [`#/${PICTURE}/compare`]: `#/calibrate/${PICTURE}/verify`,
  [`#/${PICTURE}/activate`]: `#/calibrate/${PICTURE}/verify`,
  [`#/calibrate/${PICTURE}`]: `#/calibrate/${PICTURE}/field`,
  [`#/calibrate/${PICTURE}/borders`]: `#/calibrate/${PICTURE}/points`,
};

const written = [];
for (const how of ["pushState", "replaceState"]) {
  const write = history[how];
  history[how] = (...given) => {
    written.push([how, given[2]]);
    write(...given);
  };
}
beforeEach(() => {
  goTo("#/system/server");
  written.length = 0;
});

test("each view has an address that leads to it, and no other one is written", () => {
  for (const [address, [view, words = {}]] of Object.entries(VIEWS)) {
    assert.equal(addressOf(view, words), address);
    goTo(address);
    const { view: there, place, ...named } = route.value;
    assert.equal(there, view, address);
    assert.equal(place, view === "calibrate" ? "cameras" : address.split("/")[1], address);
    assert.deepEqual(Object.fromEntries(Object.entries(named).filter(([, word]) => word)), words);
    assert.equal(redirected(address.slice(2).split("/")), null, address);
  }
  assert.deepEqual(written, []);
});

test("a former address is replaced by the present one, so that the way back leads past it", () => {
  for (const [former, present] of Object.entries(FORMER)) {
    goTo(former);
    assert.deepEqual(written.splice(0), [["replaceState", present]], former);
    assert.equal(route.value.view, VIEWS[present]?.[0] ?? "calibrate", former);
  }
});

test("the former step of the models is the one of the points with the models unfolded", () => {
  goTo(`#/${PICTURE}/model`);
  assert.deepEqual([route.value.step, isUnfolded("lens")], ["points", true]);
});

test("what is no address is nowhere, and stays as it was written", () => {
  for (const address of [
    "#/system/nothing",
    "#/%E0%A4%A",
    "#/calibrate/1/2/3/4",
    `#/calibrate/${PICTURE}/nostep`,
  ]) {
    goTo(address);
    assert.deepEqual(
      [route.value.view, route.value.place, location.hash],
      ["nowhere", "", address],
    );
  }
  assert.deepEqual(written, []);
});

test("to go somewhere is one stop on the way back, to be there already is none, to go instead replaces", () => {
  go("jobs");
  go("jobs");
  goInstead("publishing");
  go("calibrate", { picture: PICTURE, step: "points" });
  goToStep("verify");
  assert.deepEqual(written, [
    ["pushState", "#/system/jobs"],
    ["replaceState", "#/system/publishing"],
    ["pushState", `#/calibrate/${PICTURE}/points`],
    ["pushState", `#/calibrate/${PICTURE}/verify`],
  ]);
  assert.deepEqual([route.value.view, route.value.step], ["calibrate", "verify"]);
});

test("a view without the words that its address needs has none", () => {
  assert.throws(() => addressOf("live"), /live/);
});

test("a page of the manual that was renamed opens by its former name, at the heading", async () => {
  const asked = [];
  globalThis.fetch = async (address) => {
    asked.push(address);
    return { ok: true, text: async () => "# Lens check" };
  };
  await openManual("straight-edges.md#from-programs");
  assert.deepEqual(asked, ["help/straight.md"]);
  assert.equal(manualPage.value.name, "straight.md");
  assert.equal(manualPage.value.heading, "from-programs");
  await openManual("ssl-vision.md");
  assert.equal(manualPage.value.name, "league.md");
});
