// Raw and corrected on one stage: the corrected picture is laid so that its borders cover the raw ones; a wipe parts
// them,
// they blink, or they stand side by side under one view.
import { computed } from "@preact/signals";
import { address } from "../../core/api.js";
import { html } from "../../core/html.js";
import { compare, showLines } from "../../core/state.js";
import { t } from "../../core/words.js";
import { placed } from "../drawing.js";
import { Grid } from "./grid.js";
import { Heat } from "./heat.js";
import { FieldLines } from "./overlay.js";
import { ResidualArrows } from "./residual_arrows.js";
import { WarpedPicture } from "./warped_picture.js";
import { correctsHere, isOurs } from "../graphics.js";
import { MARGIN_PX, paneSize } from "../viewport.js";
import {
  activeViewport,
  compared,
  comparedVersion,
  correctedPlacement,
  counterpart,
  lines,
  margin,
  visiblePicture,
} from "../../features/compare/comparison.js";
import { mesh } from "../../features/compare/correction.js";
import { atLive, cameraView } from "../../features/live/camera_page.js";

const STEP = 0.02,
  ENDS = [0.02, 0.98];

const withLines = computed(() => (atLive.value ? cameraView.value.lines : showLines.value));

/** The corrected picture's address. @param {string} id @param {string} suffix */
export const correctedAddress = (id, suffix) =>
  address(`/calibrations/${id}/corrected.${suffix}?margin_px=${MARGIN_PX}`);

/** Where the corrected picture's corner lies on its pane, and its scale: as an <img> is placed. */
export const correctedPlace = computed(() => {
  const here = correctedPlacement.value,
    { k, tx, ty } = activeViewport.value.view.value;
  // Half a pixel: an <img> begins at its first pixel's edge, positions at its centre.
  return (
    here && {
      x: (here.x - 0.5 * here.scale + 0.5) * k + tx,
      y: (here.y - 0.5 * here.scale + 0.5) * k + ty,
      k: k * here.scale,
    }
  );
});

/** The style of the half that is corrected. */
export const correctedClip = computed(() => {
  if (visiblePicture.value === "side")
    return activeViewport.value.panes.value.rows > 1 ? "top:50%" : "left:50%";
  return visiblePicture.value === "raw"
    ? "visibility:hidden"
    : visiblePicture.value === "wipe"
      ? `clip-path:inset(0 0 0 ${compare.value.at * 100}%)`
      : "";
});

/** The style that leaves the raw half. */
export const rawClip = computed(() => {
  if (!compared.value || !correctedPlacement.value) return "";
  if (visiblePicture.value === "side")
    return activeViewport.value.panes.value.rows > 1 ? "bottom:50%" : "right:50%";
  return visiblePicture.value === "corrected"
    ? "visibility:hidden"
    : visiblePicture.value === "wipe"
      ? `clip-path:inset(0 ${(1 - compare.value.at) * 100}% 0 0)`
      : "";
});

/** The corrected half of a still. @param {{ raw: HTMLImageElement | null }} props the raw picture, once it is there */
export function Corrected({ raw }) {
  const at = correctedPlace.value,
    it = compared.value,
    saved = comparedVersion.value;
  if (!at || !it) return null;
  const size = /** @type {import("../../core/types").Point} */ (
    it.corrected_size.map((side) => side + 2 * MARGIN_PX)
  );
  return html`<div class="half" style=${correctedClip.value} data-testid="corrected-half">
    ${
      isOurs.value &&
      mesh.value &&
      html`<${WarpedPicture} picture=${raw} mesh=${mesh.value} ...${paneSize.value} ...${at}
        from=${visiblePicture.value === "wipe" ? compare.value.at : 0} />`
    }
    ${
      !correctsHere.value &&
      saved &&
      html`<img
      class="picture"
      data-testid="corrected"
      alt=${t("canvas.corrected-picture")}
      draggable=${false}
      src=${correctedAddress(saved.id, "jpg")}
      style=${`transform:translate(${at.x}px,${at.y}px) scale(${at.k})`}
    />`
    }
    <${Heat} frame="corrected" size=${size} margin=${MARGIN_PX} ...${at} />
    <${ResidualArrows} frame="corrected" ...${at} />
    <${OnCorrected} />
  </div>`;
}

/** Grid and lines over the raw half, and the place that is pointed at in the other one. */
export function OnRaw() {
  const it = comparedVersion.value;
  if (!it) return null;
  const { k, tx, ty } = activeViewport.value.view.value,
    size = it.image_size;
  return html`<svg class="overlay" aria-hidden="true">
    <${Grid} on="raw" size=${size} x=${tx} y=${ty} k=${k} />
    ${
      withLines.value &&
      lines.value &&
      html`<${FieldLines} name="on-raw" size=${size} features=${lines.value.raw} transform=${placed(tx, ty, k)} />`
    }
    <${Counterpart} on="image" x=${tx} y=${ty} k=${k} margin=${0} />
  </svg>`;
}

/** The same over the corrected half. */
export function OnCorrected() {
  const at = correctedPlace.value,
    it = compared.value;
  if (!at || !it) return null;
  const size = /** @type {import("../../core/types").Point} */ (
    it.corrected_size.map((side) => side + 2 * margin.value)
  );
  return html`<svg class="overlay" aria-hidden="true">
    <${Grid} on="corrected" size=${size} ...${at} />
    ${
      withLines.value &&
      lines.value &&
      html`<${FieldLines}
      name="on-corrected"
      features=${lines.value.corrected}
      size=${size}
      transform=${placed(at.x, at.y, at.k)}
    />`
    }
    <${Counterpart} on="corrected" ...${at} margin=${margin.value} />
  </svg>`;
}

/**
 * The same place of the field as under the pointer.
 * @param {{ on: "image" | "corrected", x: number, y: number, k: number, margin: number }} props
 */
function Counterpart({ on, x, y, k, margin: around }) {
  const it = counterpart.value;
  if (visiblePicture.value !== "side" || it?.on !== on) return null;
  const [u, v] = it.point;
  return html`<g
    class="counterpart"
    data-testid=${`counterpart-${on}`}
    transform=${`translate(${x + (u + around + 0.5) * k} ${y + (v + around + 0.5) * k})`}
  >
    <circle r="7" />
    <path d="M-16 0H-4M4 0H16M0 -16V-4M0 4V16" />
  </g>`;
}

/** The bar between raw and corrected, or the names of the two. */
export function Wipe() {
  if (!compared.value || !correctedPlacement.value) return null;
  if (visiblePicture.value === "side") return html`<${Names} />`;
  if (visiblePicture.value !== "wipe") return null;
  const { at } = compare.value;
  /** @param {number} share */
  const moveTo = (share) => {
    compare.value = { ...compare.value, at: Math.min(ENDS[1], Math.max(ENDS[0], share)) };
  };
  /** @param {PointerEvent} e */
  const down = (e) => /** @type {Element} */ (e.currentTarget).setPointerCapture(e.pointerId);
  /** @param {PointerEvent} e */
  const move = (e) => {
    const handle = /** @type {HTMLElement} */ (e.currentTarget),
      stage = /** @type {HTMLElement} */ (handle.parentElement).getBoundingClientRect();
    if (handle.hasPointerCapture(e.pointerId)) moveTo((e.clientX - stage.left) / stage.width);
  };
  /** @param {KeyboardEvent} e */
  const key = (e) => {
    const towards = { ArrowLeft: at - STEP, ArrowRight: at + STEP, Home: 0, End: 1 }[e.key];
    if (towards === undefined) return;
    e.preventDefault();
    moveTo(towards);
  };
  return html`<div
    class="wipe"
    data-off-stage
    data-testid="wipe"
    role="slider"
    tabindex="0"
    aria-label=${t("common.wipe")}
    aria-valuemin="0"
    aria-valuemax="100"
    aria-valuenow=${Math.round(at * 100)}
    aria-valuetext=${t("canvas.compare.wipe.share", { share: Math.round(at * 100) })}
    style=${`left:${at * 100}%`}
    onPointerDown=${down}
    onPointerMove=${move}
    onKeyDown=${key}
  >
    <span class="side raw">${t("common.raw")}</span>
    <span class="grip" aria-hidden="true"></span>
    <span class="side corrected">${t("common.corrected")}</span>
  </div>`;
}

const Names = () => html`<div
  class=${`side-names${activeViewport.value.panes.value.rows > 1 ? " stacked" : ""}`}
  data-testid="side-names"
>
  <span>${t("common.raw")}</span>
  <span>${t("common.corrected")}</span>
</div>`;
