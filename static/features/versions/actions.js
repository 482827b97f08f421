// Actions on versions: save one.
import { doc } from "../../core/document.js";
import { snapshot } from "../../core/state.js";
import { t } from "../../core/words.js";
import { search, stopCalibratingAgain } from "./outdated.js";
import { saveVersion, saving } from "./versions.js";

/** @type {import("../../core/actions.js").Action[]} */
export const VERSION_ACTIONS = [
  {
    id: "save",
    label: t("versions.action.save"),
    short: t("versions.action.save.short"),
    keys: ["ctrl+s"],
    group: "steps",
    run: () => void saveVersion(),
    enabled: () => snapshot.value !== null && doc.value.observations.length > 0,
  }, // if something is missing, the server says what
  {
    id: "stop-saving",
    label: t("versions.action.stop-saving"),
    short: t("common.stop"),
    group: "steps",
    run: () => saving.value?.abort(),
    enabled: () => saving.value !== null,
  },
  {
    id: "stop-calibrating-again",
    label: t("versions.action.stop-calibrating"),
    short: t("common.stop"),
    group: "steps",
    run: stopCalibratingAgain,
    enabled: () => search.value !== null,
  },
];
