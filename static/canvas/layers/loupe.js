// The loupe: raw pixels under the pointer or the selected point, with cross-hair, curves and points.
import { useEffect, useRef } from "preact/hooks";
import { doc, pointsOf } from "../../core/document.js";
import { html } from "../../core/html.js";
import { editing, pointer, selectedPoints, tool } from "../../core/state.js";
import { colour, path } from "../drawing.js";
import { stageSize, toStage, view } from "../viewport.js";
import { curves, isCurve } from "../../features/calibrate/fitting.js";
import { snapPreview } from "../../features/calibrate/snapping.js";

export const SIZE_PX = 156;
const MIN_ZOOM = 8; // screen pixels for one of the picture's: single pixels must be seen
const SNAP = "#00a86b",
  EDGE_PX = 6,
  FRESH_PX = 3; // a look ahead from farther away is an old one
const FINGER_PX = 120; // so far above a finger

/** What the loupe looks at: the point that is held or selected, else the pointer. */
function target() {
  if (!editing.value || tool.value !== "pick") return null;
  const at = pointer.value,
    last = selectedPoints.value.at(-1);
  const point = last && pointsOf(doc.value, last.feature)[last.index];
  if (point && (at?.down || !at))
    return { x: point[0], y: point[1], touch: at?.touch ?? false };
  return at && (!at.touch || at.down) ? at : null;
}

/**
 * Where it stands: above a finger, else in the corner that the target is far from.
 * @param {{ x: number, y: number, touch: boolean }} at
 */
function place(at) {
  const [sx, sy] = toStage(at.x, at.y),
    { width } = stageSize.value;
  const within = (/** @type {number} */ x) => Math.min(Math.max(8, x), width - SIZE_PX - 8);
  if (at.touch)
    return {
      left: within(sx - SIZE_PX / 2),
      top: sy > FINGER_PX + SIZE_PX ? sy - FINGER_PX - SIZE_PX / 2 : sy + FINGER_PX - SIZE_PX / 3,
    };
  return { left: sx > width / 2 && sy < 2 * SIZE_PX ? 16 : width - SIZE_PX - 16, top: 64 };
}

/** @param {{ picture: import("preact").RefObject<HTMLImageElement> }} props */
export function Loupe({ picture }) {
  const at = target();
  if (!at) return null;
  const lines = Object.entries(curves.value).flatMap(([border, curve]) =>
    isCurve(curve) ? [{ points: curve.curve, colour: colour(border) }] : [],
  );
  const rings = doc.value.observations.flatMap(({ feature, points }) =>
    points.map((point) => ({ point, colour: colour(String(feature)) })),
  );
  const there =
    snapPreview.value?.state === "snapped" &&
    Math.hypot(snapPreview.value.of[0] - at.x, snapPreview.value.of[1] - at.y) < FRESH_PX
      ? snapPreview.value
      : null;
  return html`<${Glass}
    picture=${picture}
    at=${at}
    place=${place(at)}
    k=${view.value.k}
    lines=${there ? [...lines, ...edges(there)] : lines}
    rings=${there ? [...rings, { point: there.point, colour: SNAP }] : rings}
  />`;
}

/**
 * Both edges of the line that a point would snap to.
 * @param {import("../../core/types").SnapAnswer} snap
 * @returns {Line[]}
 */
function edges({ point: [x, y], width_px = 0, direction_deg = 0 }) {
  const turn = (direction_deg * Math.PI) / 180,
    ux = Math.cos(turn),
    uy = Math.sin(turn);
  return [-0.5, 0.5].map((side) => ({
    colour: SNAP,
    points: [-EDGE_PX, EDGE_PX].map(
      (along) =>
        /** @type {import("../../core/types").Point} */ ([
          x + along * ux - side * width_px * uy,
          y + along * uy + side * width_px * ux,
        ]),
    ),
  }));
}

/**
 * @typedef {{ points: (import("../../core/types").Point | null)[], colour: string }} Line
 * @typedef {{ point: import("../../core/types").Point, colour: string }} Ring
 */

/** A round window on a picture's own pixels. at: picture pixels; place: stage pixels; k: the stage's scale.
 * @param {{ picture: import("preact").RefObject<HTMLImageElement>, at: { x: number, y: number }, place: { left: number,
 * top: number }, k: number, lines: Line[], rings: Ring[] }} props */
export function Glass({ picture, at, place: { left, top }, k, lines, rings }) {
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null)),
    ratio = devicePixelRatio;
  useEffect(() => {
    if (canvas.current && picture.current?.complete)
      draw(canvas.current, picture.current, at, Math.max(MIN_ZOOM, 2 * k), lines, rings);
  });
  return html`<canvas
    class="loupe"
    data-testid="loupe"
    ref=${canvas}
    width=${SIZE_PX * ratio}
    height=${SIZE_PX * ratio}
    style=${`left:${left}px;top:${top}px;width:${SIZE_PX}px;height:${SIZE_PX}px`}
    aria-hidden="true"
  />`;
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {HTMLImageElement} picture
 * @param {{ x: number, y: number }} at
 * @param {number} scale
 * @param {Line[]} lines
 * @param {Ring[]} rings
 */
function draw(canvas, picture, at, scale, lines, rings) {
  const g = canvas.getContext("2d");
  if (!g) return;
  const ratio = canvas.width / SIZE_PX,
    k = scale * ratio,
    half = canvas.width / 2;
  g.setTransform(1, 0, 0, 1, 0, 0);
  g.fillStyle = "#000";
  g.fillRect(0, 0, canvas.width, canvas.height);
  g.imageSmoothingEnabled = false;
  // Picture pixels, with (0, 0) the centre of the first one.
  g.setTransform(k, 0, 0, k, half - at.x * k, half - at.y * k);
  g.drawImage(picture, -0.5, -0.5);
  g.lineWidth = (1.8 * ratio) / k;
  for (const line of lines) {
    g.strokeStyle = line.colour;
    g.stroke(new Path2D(path(line.points)));
  }
  for (const {
    point: [x, y],
    colour: shade,
  } of rings)
    ring(g, x, y, (5 * ratio) / k, shade, ratio / k);
  cross(g, half, ratio);
}

/**
 * @param {CanvasRenderingContext2D} g
 * @param {number} x
 * @param {number} y
 * @param {number} r
 * @param {string} shade
 * @param {number} px
 */
function ring(g, x, y, r, shade, px) {
  g.lineWidth = 1.5 * px;
  g.strokeStyle = shade;
  g.beginPath();
  g.arc(x, y, r, 0, 2 * Math.PI);
  g.stroke();
}

/** @param {CanvasRenderingContext2D} g @param {number} half @param {number} ratio */
function cross(g, half, ratio) {
  g.setTransform(1, 0, 0, 1, half, half);
  for (const [style, width] of /** @type {[string, number][]} */ ([
    ["#000a", 3],
    ["#fff", 1],
  ])) {
    g.strokeStyle = style;
    g.lineWidth = width * ratio;
    g.beginPath();
    for (const [dx, dy] of [
      [1, 0],
      [-1, 0],
      [0, 1],
      [0, -1],
    ]) {
      g.moveTo(6 * ratio * dx, 6 * ratio * dy);
      g.lineTo(26 * ratio * dx, 26 * ratio * dy);
    }
    g.stroke();
  }
}
