// Where a picture lies on its stage: screen = translation + scale · (pixel + ½), as pixel (0, 0) is a centre.
import { signal } from "@preact/signals";

const SMALLEST = 0.05, LARGEST = 64;
const MARGIN = { top: 68, side: 28, bottom: 48 }; // room for the toolbar and the read-out
export const MARGIN_PX = 40; // carpet shown around the corrected picture, in its own pixels

/** A stage's view of its picture. @param {typeof MARGIN} margin px, left around the whole picture */
export function createView(margin) {
  const size = signal({ width: 800, height: 600 });
  /** fitted: nobody has zoomed or panned since the whole picture was shown. */
  const view = signal({ k: 1, tx: 0, ty: 0, fitted: true });

  /** @param {number} sx @param {number} sy stage pixels @returns {import("./types").Point} picture pixels */
  function toPicture(sx, sy) {
    const { k, tx, ty } = view.value;
    return [(sx - tx) / k - 0.5, (sy - ty) / k - 0.5];
  }

  /** @param {number} x @param {number} y picture pixels @returns {import("./types").Point} stage pixels */
  function toStage(x, y) {
    const { k, tx, ty } = view.value;
    return [(x + 0.5) * k + tx, (y + 0.5) * k + ty];
  }

  /** Zoom; what lies under (sx, sy) stays there. @param {number} factor @param {number} [sx] @param {number} [sy] */
  function zoomBy(factor, sx = size.value.width / 2, sy = size.value.height / 2) {
    const { k, tx, ty } = view.value;
    const next = Math.min(LARGEST, Math.max(SMALLEST, k * factor));
    view.value = { k: next, tx: sx - (sx - tx) * (next / k), ty: sy - (sy - ty) * (next / k), fitted: false };
  }

  /** @param {number} dx @param {number} dy stage pixels */
  function panBy(dx, dy) {
    const { k, tx, ty } = view.value;
    view.value = { k, tx: tx + dx, ty: ty + dy, fitted: false };
  }

  /** Show all of a picture. @param {{ width: number, height: number } | null} picture */
  function fit(picture) {
    if (!picture) return;
    const { width, height } = size.value;
    const w = Math.max(50, width - 2 * margin.side), h = Math.max(50, height - margin.top - margin.bottom);
    const k = Math.min(w / picture.width, h / picture.height);
    view.value = { k, tx: (width - k * picture.width) / 2, ty: margin.top + (h - k * picture.height) / 2, fitted: true };
  }

  /** Bring a picture point into sight, if it is not. @param {number} x @param {number} y */
  function reveal(x, y) {
    const [sx, sy] = toStage(x, y), { width, height } = size.value;
    const dx = Math.max(margin.side - sx, 0) + Math.min(width - margin.side - sx, 0);
    const dy = Math.max(margin.top - sy, 0) + Math.min(height - margin.bottom - sy, 0);
    if (dx || dy) panBy(dx, dy);
  }

  return { size, view, toPicture, toStage, zoomBy, panBy, fit, reveal };
}

/** Of the picture that is worked on. */
export const { size: stageSize, view, toPicture, toStage, zoomBy, panBy, fit, reveal } = createView(MARGIN);
