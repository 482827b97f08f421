// Actions of help: the keys, the manual, the tour; Escape closes what is open.
import { help, selection } from "../../core/state.js";
import { t } from "../../core/words.js";
import { discardProposed, offered } from "../calibrate/line_suggestions.js";
import { leaveTour, takeTour, tour } from "./tour.js";

/** @type {import("../../core/actions.js").Action[]} */
export const HELP_ACTIONS = [
  {
    id: "keys",
    label: t("help.action.keys"),
    short: "?",
    keys: ["?"],
    group: "help",
    run: () => {
      help.value = help.value === "keys" ? "" : "keys";
    },
  },
  {
    id: "manual",
    label: t("help.action.manual"),
    short: t("help.action.manual.short"),
    keys: ["F1"],
    group: "help",
    run: () => {
      help.value = help.value === "manual" ? "" : "manual";
    },
  },
  {
    id: "tour",
    label: t("help.action.tour"),
    short: t("help.action.tour.short"),
    keys: ["F2"],
    group: "help",
    run: () => {
      if (tour.value.on) leaveTour();
      else takeTour();
    },
  },
  {
    id: "escape",
    label: t("help.action.escape"),
    keys: ["Escape"],
    group: "help",
    run: () => {
      if (offered.value.length) discardProposed();
      else if (help.value) help.value = "";
      else selection.value = [];
    },
  },
];
