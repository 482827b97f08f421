// Where a field lies on the stage: its drawing has a pixel for ten millimetres, y up, and room around the borders.
import { viewport } from "./editor.js";

/** @typedef {import("../../core/types").Point} Point @typedef {import("./types").FieldDoc} FieldDoc */

const MM_PER_PX = 10;
const ROOM = 0.08; // of the length, on every side

/** @param {Pick<FieldDoc, "length_mm" | "width_mm">} doc */
const roomOf = ({ length_mm: length }) => ROOM * length;

/** @param {Pick<FieldDoc, "length_mm" | "width_mm">} doc */
export const drawingSize = (doc) => ({
  width: (doc.length_mm + 2 * roomOf(doc)) / MM_PER_PX,
  height: (doc.width_mm + 2 * roomOf(doc)) / MM_PER_PX,
});

/** @param {FieldDoc} doc @param {Point} p pixels of the drawing @returns {Point} field mm */
export function fieldPoint(doc, [x, y]) {
  const { width, height } = drawingSize(doc);
  return [(x + 0.5 - width / 2) * MM_PER_PX, (height / 2 - y - 0.5) * MM_PER_PX];
}

/** From field mm to the stage, for a group in SVG. @param {FieldDoc} doc */
export function stageTransform(doc) {
  const { k, tx, ty } = viewport.view.value,
    { width, height } = drawingSize(doc);
  return `translate(${tx + (k * width) / 2} ${ty + (k * height) / 2}) scale(${k / MM_PER_PX} ${-k / MM_PER_PX})`;
}

export const mmPerStagePx = () => MM_PER_PX / viewport.view.value.k;
