// Actions on how the picture is viewed: pan, zoom, draw the field's lines.
import { showLines, snapshot, tool } from "../../core/state.js";
import { activeViewport, comparedVersion } from "../compare/comparison.js";
import { version } from "../versions/versions.js";
import { preview } from "./fitting.js";

const ZOOM = 1.25;
export const canZoom = () => snapshot.value !== null || comparedVersion.value !== null;
/** The picture's whole size, of a live one that of its calibration. */
const whole = () =>
  snapshot.value ??
  (comparedVersion.value && {
    width: comparedVersion.value.image_size[0],
    height: comparedVersion.value.image_size[1],
  });

/** @type {import("../../core/actions.js").Action[]} */
export const VIEW_ACTIONS = [
  {
    id: "pan",
    label: "Pan the picture",
    short: "Pan",
    keys: ["h"],
    group: "View",
    run: () => {
      tool.value = "pan";
    },
    pressed: () => tool.value === "pan",
  },
  {
    id: "zoom-in",
    label: "Zoom in",
    short: "+",
    keys: ["+", "="],
    group: "View",
    run: () => activeViewport.value.zoomBy(ZOOM),
    enabled: canZoom,
  },
  {
    id: "zoom-out",
    label: "Zoom out",
    short: "−",
    keys: ["-"],
    group: "View",
    run: () => activeViewport.value.zoomBy(1 / ZOOM),
    enabled: canZoom,
  },
  {
    id: "zoom-fit",
    label: "Show the whole picture",
    short: "Fit",
    keys: ["0"],
    group: "View",
    run: () => activeViewport.value.fit(whole()),
    enabled: canZoom,
  },
  {
    id: "lines",
    label: "Draw the field's lines on the picture",
    short: "Lines",
    keys: ["l"],
    group: "View",
    run: () => {
      showLines.value = !showLines.value;
    },
    pressed: () => showLines.value,
    enabled: () => preview.value !== null || version.value !== null,
  },
];
