// Actions on how the picture is viewed: pan, zoom, draw the field's lines.
import { showLines, snapshot, tool } from "../../core/state.js";
import { t } from "../../core/words.js";
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
    label: t("calibrate.view-actions.pan"),
    short: t("calibrate.view-actions.pan.short"),
    keys: ["h"],
    group: "view",
    run: () => {
      tool.value = "pan";
    },
    pressed: () => tool.value === "pan",
  },
  {
    id: "zoom-in",
    label: t("calibrate.view-actions.zoom-in"),
    short: "+",
    keys: ["+", "="],
    group: "view",
    run: () => activeViewport.value.zoomBy(ZOOM),
    enabled: canZoom,
  },
  {
    id: "zoom-out",
    label: t("calibrate.view-actions.zoom-out"),
    short: "−",
    keys: ["-"],
    group: "view",
    run: () => activeViewport.value.zoomBy(1 / ZOOM),
    enabled: canZoom,
  },
  {
    id: "zoom-fit",
    label: t("calibrate.view-actions.fit"),
    short: t("calibrate.view-actions.fit.short"),
    keys: ["0"],
    group: "view",
    run: () => activeViewport.value.fit(whole()),
    enabled: canZoom,
  },
  {
    id: "lines",
    label: t("calibrate.view-actions.lines"),
    short: t("calibrate.view-actions.lines.short"),
    keys: ["l"],
    group: "view",
    run: () => {
      showLines.value = !showLines.value;
    },
    pressed: () => showLines.value,
    enabled: () => preview.value !== null || version.value !== null,
  },
];
