// Where the picture lies on the stage: screen = translation + scale · (pixel + ½), as pixel (0, 0) is a centre.
import { signal } from "@preact/signals";

const SMALLEST = 0.05, LARGEST = 64;
const MARGIN = { top: 68, side: 28, bottom: 48 }; // room for the toolbar and the read-out

export const stageSize = signal({ width: 800, height: 600 });
/** fitted: nobody has zoomed or panned since the whole picture was shown. */
export const view = signal({ k: 1, tx: 0, ty: 0, fitted: true });

/** @param {number} sx @param {number} sy stage pixels @returns {import("./types").Point} picture pixels */
export function toPicture(sx, sy) {
  const { k, tx, ty } = view.value;
  return [(sx - tx) / k - 0.5, (sy - ty) / k - 0.5];
}

/** @param {number} x @param {number} y picture pixels @returns {import("./types").Point} stage pixels */
export function toStage(x, y) {
  const { k, tx, ty } = view.value;
  return [(x + 0.5) * k + tx, (y + 0.5) * k + ty];
}

/** Zoom; what lies under (sx, sy) stays there. @param {number} factor @param {number} [sx] @param {number} [sy] */
export function zoomBy(factor, sx = stageSize.value.width / 2, sy = stageSize.value.height / 2) {
  const { k, tx, ty } = view.value;
  const next = Math.min(LARGEST, Math.max(SMALLEST, k * factor));
  view.value = { k: next, tx: sx - (sx - tx) * (next / k), ty: sy - (sy - ty) * (next / k), fitted: false };
}

/** @param {number} dx @param {number} dy stage pixels */
export function panBy(dx, dy) {
  const { k, tx, ty } = view.value;
  view.value = { k, tx: tx + dx, ty: ty + dy, fitted: false };
}

/** Show all of a picture. @param {{ width: number, height: number } | null} picture */
export function fit(picture) {
  if (!picture) return;
  const { width, height } = stageSize.value;
  const w = Math.max(50, width - 2 * MARGIN.side), h = Math.max(50, height - MARGIN.top - MARGIN.bottom);
  const k = Math.min(w / picture.width, h / picture.height);
  view.value = { k, tx: (width - k * picture.width) / 2, ty: MARGIN.top + (h - k * picture.height) / 2, fitted: true };
}

/** Bring a picture point into sight, if it is not. @param {number} x @param {number} y */
export function reveal(x, y) {
  const [sx, sy] = toStage(x, y), { width, height } = stageSize.value;
  const dx = Math.max(MARGIN.side - sx, 0) + Math.min(width - MARGIN.side - sx, 0);
  const dy = Math.max(MARGIN.top - sy, 0) + Math.min(height - MARGIN.bottom - sy, 0);
  if (dx || dy) panBy(dx, dy);
}
