// Actions on what is drawn over a version's picture: error map, residual arrows, difference from another version.
import { t } from "../../core/words.js";
import { canHeat, comparableVersions, differenceFrom, heat } from "./heat.js";
import { arrows, canArrow, magnify, magnifyBy, shownArrows } from "./residual_arrows.js";

/** @type {import("../../core/actions.js").Action[]} */
export const MAP_ACTIONS = [
  {
    id: "heat",
    label: t("compare.action.heat.label"),
    short: t("compare.action.heat.short"),
    keys: ["e"],
    group: "view",
    run: () => {
      heat.value = { ...heat.value, what: heat.value.what === "expected" ? "none" : "expected" };
    },
    pressed: () => heat.value.what === "expected",
    enabled: () => canHeat.value,
  },
  {
    id: "heat-height",
    label: t("compare.action.heat-height.label"),
    short: t("compare.action.heat-height.short"),
    keys: ["z"],
    group: "view",
    run: () => {
      heat.value = { ...heat.value, atHats: !heat.value.atHats };
    },
    pressed: () => heat.value.atHats,
    enabled: () => canHeat.value && heat.value.what === "expected",
  },
  {
    id: "arrows",
    label: t("compare.action.arrows.label"),
    short: t("compare.action.arrows.short"),
    keys: ["v"],
    group: "view",
    run: () => {
      arrows.value = { ...arrows.value, on: !arrows.value.on };
    },
    pressed: () => arrows.value.on,
    enabled: () => canArrow.value,
  },
  {
    id: "arrows-longer",
    label: t("compare.action.arrows-longer.label"),
    keys: ["."],
    group: "view",
    run: () => magnifyBy(1),
    enabled: () => shownArrows.value !== null,
  },
  {
    id: "arrows-shorter",
    label: t("compare.action.arrows-shorter.label"),
    keys: [","],
    group: "view",
    run: () => magnifyBy(-1),
    enabled: () => shownArrows.value !== null,
  },
  {
    id: "arrows-auto",
    label: t("compare.action.arrows-auto.label"),
    group: "view",
    run: () => magnify(null),
    enabled: () => shownArrows.value !== null,
  },
  {
    id: "difference",
    label: t("compare.action.difference.label"),
    short: t("compare.action.difference.short"),
    keys: ["d"],
    group: "view",
    run: () => {
      if (heat.value.what === "difference") heat.value = { ...heat.value, what: "none" };
      else differenceFrom();
    },
    pressed: () => heat.value.what === "difference",
    enabled: () => canHeat.value && comparableVersions.value.length > 0,
  },
];
