// Actions on a rig: make it, check it, stop its work.
import { go, route } from "../../core/route.js";
import { checkRig, makeRig, rig, search, stopRig } from "./rig.js";

/** @type {import("../../core/actions.js").Action[]} */
export const RIG_ACTIONS = [
  {
    id: "new-rig",
    label: "Make a rig of cameras that share a field…",
    short: "Make a rig…",
    group: "Pages",
    run: () => go("new-rig"),
  },
  {
    id: "make-rig",
    label: "Make the rig",
    group: "Pages",
    run: () => void makeRig(),
    enabled: () => route.value.view === "new-rig",
  },
  {
    id: "check-rig",
    label: "Check whether the rig's cameras agree",
    short: "Check the rig",
    group: "Pages",
    run: () => void checkRig(),
    enabled: () => rig.value !== null && search.value === null,
  },
  {
    id: "stop-rig",
    label: "Stop the rig's work",
    short: "Stop",
    group: "Pages",
    run: stopRig,
    enabled: () => search.value !== null,
  },
];
