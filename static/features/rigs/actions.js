// Actions on a rig: make it, check it, stop its work.
import { go, route } from "../../core/route.js";
import { t } from "../../core/words.js";
import { checkRig, makeRig, rig, search, stopRig } from "./rig.js";

/** @type {import("../../core/actions.js").Action[]} */
export const RIG_ACTIONS = [
  {
    id: "new-rig",
    label: t("rig.action.new"),
    short: t("rig.action.new.short"),
    group: "pages",
    run: () => go("new-rig"),
  },
  {
    id: "make-rig",
    label: t("rig.make"),
    group: "pages",
    run: () => void makeRig(),
    enabled: () => route.value.view === "new-rig",
  },
  {
    id: "check-rig",
    label: t("rig.action.check"),
    short: t("rig.check"),
    group: "pages",
    run: () => void checkRig(),
    enabled: () => rig.value !== null && search.value === null,
  },
  {
    id: "stop-rig",
    label: t("rig.action.stop"),
    short: t("common.stop"),
    group: "pages",
    run: stopRig,
    enabled: () => search.value !== null,
  },
];
