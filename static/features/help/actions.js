// Actions of help: the keys, the manual, the tour; Escape closes what is open.
import { help, selection } from "../../core/state.js";
import { discardProposed, offered } from "../calibrate/line_suggestions.js";
import { chosen } from "../pair/pair.js";
import { leaveTour, takeTour, tour } from "./tour.js";

/** @type {import("../../core/actions.js").Action[]} */
export const HELP_ACTIONS = [
  {
    id: "keys",
    label: "Show the keys",
    short: "?",
    keys: ["?"],
    group: "Help",
    run: () => {
      help.value = help.value === "keys" ? "" : "keys";
    },
  },
  {
    id: "manual",
    label: "Open the manual",
    short: "Manual",
    keys: ["F1"],
    group: "Help",
    run: () => {
      help.value = help.value === "manual" ? "" : "manual";
    },
  },
  {
    id: "tour",
    label: "Take the tour, or leave it",
    short: "Tour",
    keys: ["F2"],
    group: "Help",
    run: () => {
      if (tour.value.on) leaveTour();
      else takeTour();
    },
  },
  {
    id: "escape",
    label: "Close help, or deselect",
    keys: ["Escape"],
    group: "Help",
    run: () => {
      if (offered.value.length) discardProposed();
      else if (help.value) help.value = "";
      else {
        selection.value = [];
        chosen.value = null;
      }
    },
  },
];
