// Actions that snap points to painted lines, and that propose points along them.
import { doc } from "../../core/document.js";
import { editing, selectedPoints } from "../../core/state.js";
import { acceptProposed, canPropose, discardProposed, offered, propose } from "./line_suggestions.js";
import { snapPoints, snapping, toggleSnapping } from "./snapping.js";

const all = () =>
  doc.value.observations.flatMap(({ feature, points }) =>
    typeof feature === "string" ? points.map((_, index) => ({ feature, index })) : [],
  );

/** @type {import("../../core/actions.js").Action[]} */
export const SNAP_ACTIONS = [
  {
    id: "snap",
    label: "Snap points to the middle of the painted line; Alt places one freely",
    short: "Snap",
    keys: ["s"],
    group: "Points",
    run: toggleSnapping,
    pressed: () => snapping.value,
    enabled: () => editing.value,
  },
  {
    id: "snap-points",
    label: "Snap the selected points, or all where none is selected",
    short: "Snap the points",
    keys: ["q"],
    group: "Points",
    run: () => void snapPoints(selectedPoints.value.length ? selectedPoints.value : all()),
    enabled: () => editing.value && doc.value.observations.length > 0,
  },
  {
    id: "propose",
    label: "Find points along this line where the fit sees it; again to add them",
    short: "Find points along it",
    keys: ["f"],
    group: "Points",
    run: () => {
      if (offered.value.length) acceptProposed();
      else void propose();
    },
    enabled: () => editing.value && (offered.value.length > 0 || canPropose.value),
  },
  {
    id: "discard",
    label: "Discard the proposed points",
    short: "Discard",
    group: "Points",
    run: discardProposed,
    enabled: () => offered.value.length > 0,
  },
];
