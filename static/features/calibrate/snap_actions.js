// Actions that snap points to painted lines, and that propose points along them.
import { doc } from "../../core/document.js";
import { editing, selectedPoints } from "../../core/state.js";
import { t } from "../../core/words.js";
import {
  acceptProposed,
  canPropose,
  discardProposed,
  offered,
  propose,
} from "./line_suggestions.js";
import { snapPoints, snapping, toggleSnapping } from "./snapping.js";

const all = () =>
  doc.value.observations.flatMap(({ feature, points }) =>
    typeof feature === "string" ? points.map((_, index) => ({ feature, index })) : [],
  );

/** @type {import("../../core/actions.js").Action[]} */
export const SNAP_ACTIONS = [
  {
    id: "snap",
    label: t("calibrate.snap-actions.snap"),
    short: t("calibrate.snap-actions.snap.short"),
    keys: ["s"],
    group: "points",
    run: toggleSnapping,
    pressed: () => snapping.value,
    enabled: () => editing.value,
  },
  {
    id: "snap-points",
    label: t("calibrate.snap-actions.snap-points"),
    short: t("calibrate.snap-actions.snap-points.short"),
    keys: ["q"],
    group: "points",
    run: () => void snapPoints(selectedPoints.value.length ? selectedPoints.value : all()),
    enabled: () => editing.value && doc.value.observations.length > 0,
  },
  {
    id: "propose",
    label: t("calibrate.snap-actions.propose"),
    short: t("calibrate.snap-actions.propose.short"),
    keys: ["f"],
    group: "points",
    run: () => {
      if (offered.value.length) acceptProposed();
      else void propose();
    },
    enabled: () => editing.value && (offered.value.length > 0 || canPropose.value),
  },
  {
    id: "discard",
    label: t("calibrate.snap-actions.discard"),
    short: t("calibrate.snap-actions.discard.short"),
    group: "points",
    run: discardProposed,
    enabled: () => offered.value.length > 0,
  },
];
