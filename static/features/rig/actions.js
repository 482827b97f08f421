// Actions on a rig: make it, check it, stop its work.
import { page } from "../../core/page.js";
import { checkRig, makeRig, openNewRig, rig, search, stopRig } from "./rig.js";

/** @type {import("../../core/actions.js").Action[]} */
export const RIG_ACTIONS = [
  {
    id: "new-rig",
    label: "Make a rig of cameras that share a field…",
    short: "Make a rig…",
    group: "Pages",
    run: openNewRig,
  },
  {
    id: "make-rig",
    label: "Make the rig",
    group: "Pages",
    run: () => void makeRig(),
    enabled: () => page.value?.name === "rig",
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
