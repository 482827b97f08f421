// Actions on versions: save one.
import { doc } from "../../core/document.js";
import { snapshot } from "../../core/state.js";
import { search, stopCalibratingAgain } from "./outdated.js";
import { saveVersion, saving } from "./versions.js";

/** @type {import("../../core/actions.js").Action[]} */
export const VERSION_ACTIONS = [
  {
    id: "save",
    label: "Save a version and verify it",
    short: "Save a version",
    keys: ["ctrl+s"],
    group: "Steps",
    run: () => void saveVersion(),
    enabled: () => snapshot.value !== null && doc.value.observations.length > 0,
  }, // if something is missing, the server says what
  {
    id: "stop-saving",
    label: "Stop saving the version",
    short: "Stop",
    group: "Steps",
    run: () => saving.value?.abort(),
    enabled: () => saving.value !== null,
  },
  {
    id: "stop-calibrating-again",
    label: "Stop calibrating again",
    short: "Stop",
    group: "Steps",
    run: stopCalibratingAgain,
    enabled: () => search.value !== null,
  },
];
