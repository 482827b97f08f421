// Actions that open a page beside calibrating, and that go back from it.
import { backAddress, go } from "../../core/route.js";
import { cameras, snapshot } from "../../core/state.js";

/** @type {import("../../core/actions.js").Action[]} */
export const PAGE_ACTIONS = [
  { id: "jobs", label: "Show long work", keys: ["i"], group: "Pages", run: () => go("jobs") },
  {
    id: "versions",
    label: "Show all saved versions",
    keys: ["y"],
    group: "Pages",
    run: () => go("versions", { camera: snapshot.value?.camera ?? cameras.value[0]?.id }),
  },
  { id: "settings", label: "Show the settings", group: "Pages", run: () => go("server") },
  {
    id: "back",
    label: "Go back from a page",
    short: "Back",
    group: "Pages",
    run: () => {
      location.hash = backAddress.value;
    },
    enabled: () => location.hash !== backAddress.value,
  },
];
