// Actions that open a page beside the six steps, and that go back from it.
import { backAddress, page } from "../../core/page.js";
import { cameras, snapshot } from "../../core/state.js";
import { openPage } from "./open_page.js";

/** @type {import("../../core/actions.js").Action[]} */
export const PAGE_ACTIONS = [
  { id: "jobs", label: "Show long work", keys: ["i"], group: "Pages", run: () => openPage("jobs") },
  {
    id: "versions",
    label: "Show all saved versions",
    keys: ["y"],
    group: "Pages",
    run: () => openPage("versions", snapshot.value?.camera ?? cameras.value[0]?.id ?? ""),
  },
  { id: "settings", label: "Show the settings", group: "Pages", run: () => openPage("settings") },
  {
    id: "back",
    label: "Go back from a page",
    short: "Back",
    group: "Pages",
    run: () => {
      location.hash = backAddress();
    },
    enabled: () => page.value !== null,
  },
];
