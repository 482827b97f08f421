// Actions on what is drawn over a version's picture: error map, residual arrows, difference from another version.
import { canHeat, comparableVersions, differenceFrom, heat } from "./heat.js";
import { arrows, canArrow, magnify, magnifyBy, shownArrows } from "./residual_arrows.js";

/** @type {import("../../core/actions.js").Action[]} */
export const MAP_ACTIONS = [
  {
    id: "heat",
    label: "Show the expected error over the field",
    short: "Error",
    keys: ["e"],
    group: "View",
    run: () => {
      heat.value = { ...heat.value, what: heat.value.what === "expected" ? "none" : "expected" };
    },
    pressed: () => heat.value.what === "expected",
    enabled: () => canHeat.value,
  },
  {
    id: "heat-height",
    label: "Switch the expected error between carpet and hat height",
    short: "Hat height",
    keys: ["z"],
    group: "View",
    run: () => {
      heat.value = { ...heat.value, atHats: !heat.value.atHats };
    },
    pressed: () => heat.value.atHats,
    enabled: () => canHeat.value && heat.value.what === "expected",
  },
  {
    id: "arrows",
    label: "Show residuals as arrows, to where the model puts each click",
    short: "Arrows",
    keys: ["v"],
    group: "View",
    run: () => {
      arrows.value = { ...arrows.value, on: !arrows.value.on };
    },
    pressed: () => arrows.value.on,
    enabled: () => canArrow.value,
  },
  {
    id: "arrows-longer",
    label: "Magnify the arrows more",
    keys: ["."],
    group: "View",
    run: () => magnifyBy(1),
    enabled: () => shownArrows.value !== null,
  },
  {
    id: "arrows-shorter",
    label: "Magnify the arrows less",
    keys: [","],
    group: "View",
    run: () => magnifyBy(-1),
    enabled: () => shownArrows.value !== null,
  },
  {
    id: "arrows-auto",
    label: "Magnify the arrows so that they can be read",
    group: "View",
    run: () => magnify(null),
    enabled: () => shownArrows.value !== null,
  },
  {
    id: "difference",
    label: "Show the difference from another version",
    short: "Choose a version…",
    keys: ["d"],
    group: "View",
    run: () => {
      if (heat.value.what === "difference") heat.value = { ...heat.value, what: "none" };
      else differenceFrom();
    },
    pressed: () => heat.value.what === "difference",
    enabled: () => canHeat.value && comparableVersions.value.length > 0,
  },
];
