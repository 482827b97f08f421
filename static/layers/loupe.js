// The loupe: raw pixels under the pointer or the selected point, with cross-hair, curve and points.
import { useEffect, useRef } from "preact/hooks";
import { doc, pointsOf } from "../document.js";
import { curves, isCurve } from "../fitting.js";
import { html } from "../html.js";
import { editing, picked, pointer, step, tool } from "../state.js";
import { stageSize, toStage, view } from "../view.js";
import { colour, path } from "./drawing.js";

const SIZE_PX = 156;
const LEAST = 8; // screen pixels for one of the picture's: single pixels must be seen
const FINGER_PX = 120; // so far above a finger

/** What the loupe looks at: the point that is held or selected, else the pointer. */
function target() {
  if (!editing.value || tool.value !== "pick") return null;
  const at = pointer.value, last = picked.value.at(-1);
  const point = last && pointsOf(doc.value, last.feature)[last.index];
  if (point && (at?.down || (!at && step.value === "borders"))) return { x: point[0], y: point[1], touch: at?.touch ?? false };
  return at && (!at.touch || at.down) ? at : null;
}

/** Where it stands: above a finger, else in the corner that the target is far from. @param {{ x: number, y: number, touch: boolean }} at */
function place(at) {
  const [sx, sy] = toStage(at.x, at.y), { width } = stageSize.value;
  const within = (/** @type {number} */ x) => Math.min(Math.max(8, x), width - SIZE_PX - 8);
  if (at.touch) return { left: within(sx - SIZE_PX / 2), top: sy > FINGER_PX + SIZE_PX ? sy - FINGER_PX - SIZE_PX / 2 : sy + FINGER_PX - SIZE_PX / 3 };
  return { left: sx > width / 2 && sy < 2 * SIZE_PX ? 16 : width - SIZE_PX - 16, top: 64 };
}

/** @param {{ picture: import("preact").RefObject<HTMLImageElement> }} props */
export function Loupe({ picture }) {
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const at = target(), shown = curves.value, document = doc.value, { k } = view.value;
  useEffect(() => { if (at && canvas.current && picture.current?.complete) draw(canvas.current, picture.current, at, Math.max(LEAST, 2 * k)); },
    [at?.x, at?.y, shown, document, k]);
  if (!at) return null;
  const { left, top } = place(at), ratio = devicePixelRatio;
  return html`<canvas class="loupe" data-testid="loupe" ref=${canvas} width=${SIZE_PX * ratio} height=${SIZE_PX * ratio}
    style=${`left:${left}px;top:${top}px;width:${SIZE_PX}px;height:${SIZE_PX}px`} aria-hidden="true"/>`;
}

/** @param {HTMLCanvasElement} canvas @param {HTMLImageElement} picture @param {{ x: number, y: number }} at @param {number} scale */
function draw(canvas, picture, at, scale) {
  const g = canvas.getContext("2d");
  if (!g) return;
  const ratio = canvas.width / SIZE_PX, k = scale * ratio, half = canvas.width / 2;
  g.setTransform(1, 0, 0, 1, 0, 0);
  g.fillStyle = "#000";
  g.fillRect(0, 0, canvas.width, canvas.height);
  g.imageSmoothingEnabled = false;
  // Picture pixels, with (0, 0) the centre of the first one.
  g.setTransform(k, 0, 0, k, half - at.x * k, half - at.y * k);
  g.drawImage(picture, -0.5, -0.5);
  for (const [border, curve] of Object.entries(curves.value)) {
    if (!isCurve(curve)) continue;
    g.lineWidth = 1.8 * ratio / k;
    g.strokeStyle = colour(border);
    g.stroke(new Path2D(path(curve.curve)));
  }
  for (const { feature, points } of doc.value.observations) for (const [x, y] of points) ring(g, x, y, 5 * ratio / k, String(feature), ratio / k);
  cross(g, half, ratio);
}

/** @param {CanvasRenderingContext2D} g @param {number} x @param {number} y @param {number} r @param {string} feature @param {number} px */
function ring(g, x, y, r, feature, px) {
  g.lineWidth = 1.5 * px;
  g.strokeStyle = colour(feature);
  g.beginPath();
  g.arc(x, y, r, 0, 2 * Math.PI);
  g.stroke();
}

/** @param {CanvasRenderingContext2D} g @param {number} half @param {number} ratio */
function cross(g, half, ratio) {
  g.setTransform(1, 0, 0, 1, half, half);
  for (const [style, width] of /** @type {[string, number][]} */ ([["#000a", 3], ["#fff", 1]])) {
    g.strokeStyle = style;
    g.lineWidth = width * ratio;
    g.beginPath();
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      g.moveTo(6 * ratio * dx, 6 * ratio * dy);
      g.lineTo(26 * ratio * dx, 26 * ratio * dy);
    }
    g.stroke();
  }
}
