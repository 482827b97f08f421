// Where a picture lies on its stage: screen = translation + scale · (pixel + ½), as pixel (0, 0) is a centre.
import { computed, signal } from "@preact/signals";

const NARROW = 0.04; // of its width: a small pane has no more to spare beside its picture
const SMALLEST = 0.05,
  LARGEST = 64;
const BESIDE_PX = 12; // left free around the whole picture
export const MARGIN_PX = 40; // carpet shown around the corrected picture, in its own pixels

export const PIXELATED_FROM = 4; // from this zoom on, pixels are shown as the squares they are

/**
 * The style of a picture under a view.
 * @param {number} tx
 * @param {number} ty px of the stage
 * @param {number} k stage pixels for each of the picture
 */
export const placed = (tx, ty, k) =>
  `transform:translate(${tx}px,${ty}px) scale(${k});${k >= PIXELATED_FROM ? "image-rendering:pixelated" : ""}`;

/** @typedef {{ width: number, height: number } | null} Size of a picture; null is none */

/** Whether it is on the picture. @param {Size} picture @param {number} x @param {number} y */
export const isOn = (picture, x, y) =>
  picture !== null &&
  x >= -0.5 &&
  y >= -0.5 &&
  x <= picture.width - 0.5 &&
  y <= picture.height - 0.5;

/**
 * The nearest point on the picture, to a hundredth of a pixel: finer than anybody can click.
 * @param {Size} picture
 * @param {number} x
 * @param {number} y
 * @returns {import("../core/types").Point}
 */
export function pointOn(picture, x, y) {
  const { width, height } = picture ?? { width: 1, height: 1 },
    on = (/** @type {number} */ v, /** @type {number} */ end) =>
      Math.round(Math.min(Math.max(v, -0.5), end - 0.5) * 100) / 100;
  return [on(x, width), on(y, height)];
}

/** A stage's view of its picture. */
export function createViewport() {
  const size = signal({ width: 800, height: 600 });
  /**
   * How many pictures stand side by side or one above the other, each under the same view in its own part of the stage.
   */
  const panes = signal({ columns: 1, rows: 1 });
  const pane = computed(() => ({
    width: size.value.width / panes.value.columns,
    height: size.value.height / panes.value.rows,
  }));
  /** fitted: nobody has zoomed or panned since the whole picture was shown. */
  const view = signal({ k: 1, tx: 0, ty: 0, fitted: true });

  /**
   * Stage pixels to those of the pane that they are in.
   * @param {number} sx
   * @param {number} sy
   * @returns {import("../core/types").Point}
   */
  function inPane(sx, sy) {
    const { width, height } = pane.value,
      { columns, rows } = panes.value;
    return [
      sx - width * Math.max(0, Math.min(columns - 1, Math.floor(sx / width))),
      sy - height * Math.max(0, Math.min(rows - 1, Math.floor(sy / height))),
    ];
  }

  /** Which pane a place of the stage is in: 1 for the second. @param {number} sx @param {number} sy stage pixels */
  const paneAt = (sx, sy) =>
    (panes.value.columns > 1 && sx >= pane.value.width) ||
    (panes.value.rows > 1 && sy >= pane.value.height)
      ? 1
      : 0;

  /** @param {number} sx @param {number} sy stage pixels @returns {import("../core/types").Point} picture pixels */
  function toPicture(sx, sy) {
    const { k, tx, ty } = view.value,
      [x, y] = inPane(sx, sy);
    return [(x - tx) / k - 0.5, (y - ty) / k - 0.5];
  }

  /** @param {number} x @param {number} y picture pixels @returns {import("../core/types").Point} stage pixels */
  function toStage(x, y) {
    const { k, tx, ty } = view.value;
    return [(x + 0.5) * k + tx, (y + 0.5) * k + ty];
  }

  /** Zoom; what lies under (sx, sy) stays there. @param {number} factor @param {number} [sx] @param {number} [sy] */
  function zoomBy(factor, sx = pane.value.width / 2, sy = pane.value.height / 2) {
    const { k, tx, ty } = view.value,
      [x, y] = inPane(sx, sy);
    const next = Math.min(LARGEST, Math.max(SMALLEST, k * factor));
    view.value = {
      k: next,
      tx: x - (x - tx) * (next / k),
      ty: y - (y - ty) * (next / k),
      fitted: false,
    };
  }

  /** @param {number} dx @param {number} dy stage pixels */
  function panBy(dx, dy) {
    const { k, tx, ty } = view.value;
    view.value = { k, tx: tx + dx, ty: ty + dy, fitted: false };
  }

  /** Show all of a picture. @param {{ width: number, height: number } | null} picture */
  function fit(picture) {
    if (!picture) return;
    const { width, height } = pane.value;
    const w = Math.max(50, width - 2 * Math.min(BESIDE_PX, NARROW * width)),
      h = Math.max(50, height - 2 * BESIDE_PX);
    const k = Math.min(w / picture.width, h / picture.height);
    view.value = {
      k,
      tx: (width - k * picture.width) / 2,
      ty: (height - k * picture.height) / 2,
      fitted: true,
    };
  }

  /** Bring a picture point into sight, if it is not. @param {number} x @param {number} y */
  function reveal(x, y) {
    const [sx, sy] = toStage(x, y),
      { width, height } = pane.value;
    const dx = Math.max(BESIDE_PX - sx, 0) + Math.min(width - BESIDE_PX - sx, 0);
    const dy = Math.max(BESIDE_PX - sy, 0) + Math.min(height - BESIDE_PX - sy, 0);
    if (dx || dy) panBy(dx, dy);
  }

  /**
   * Bring a picture point into the middle, at least so large.
   * @param {number} x
   * @param {number} y
   * @param {number} least scale
   */
  function centre(x, y, least) {
    const k = Math.min(LARGEST, Math.max(view.value.k, least)),
      { width, height } = pane.value;
    view.value = {
      k,
      tx: width / 2 - (x + 0.5) * k,
      ty: height / 2 - (y + 0.5) * k,
      fitted: false,
    };
  }

  /**
   * Divide the stage anew; what was in the middle stays there.
   * @param {{ columns: number, rows: number }} next
   * @param {{ width: number, height: number } | null} picture
   */
  function divide(next, picture) {
    if (panes.value.columns === next.columns && panes.value.rows === next.rows) return;
    const before = pane.value;
    panes.value = next;
    if (view.value.fitted) return fit(picture);
    panBy((pane.value.width - before.width) / 2, (pane.value.height - before.height) / 2);
  }

  return {
    size,
    view,
    panes,
    pane,
    paneAt,
    toPicture,
    toStage,
    zoomBy,
    panBy,
    fit,
    reveal,
    centre,
    divide,
  };
}

/** Of the picture that is worked on. */
export const mainViewport = createViewport();
export const {
  size: stageSize,
  pane: paneSize,
  view,
  toPicture,
  toStage,
  zoomBy,
  panBy,
  fit,
  reveal,
} = mainViewport;
