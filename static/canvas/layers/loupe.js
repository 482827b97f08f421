// The loupe: raw pixels under the pointer or the selected point, with cross-hair, curves and points. It stands beside
// the picture; over it only where there is no room beside, and above a finger.
import { computed, signal } from "@preact/signals";
import { createRef } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { doc, pointsOf } from "../../core/document.js";
import { lineTitle } from "../../core/format.js";
import { html } from "../../core/html.js";
import { editing, pointer, selectedPoints, tool } from "../../core/state.js";
import { t } from "../../core/words.js";
import { colour, path } from "../drawing.js";
import { stageSize, toStage, view } from "../viewport.js";
import { curves, isCurve } from "../../features/calibrate/fitting.js";
import { snapPreview } from "../../features/calibrate/snapping.js";

export const SIZE_PX = 156; // of the floating one
const MIN_ZOOM = 8; // screen pixels for one of the picture's: single pixels must be seen
const SNAP = "#00a86b",
  EDGE_PX = 6,
  FRESH_PX = 3; // a look ahead from farther away is an old one
const FINGER_PX = 120, // so far above a finger
  BESIDE_FINGER_PX = 60; // or beside it, where there is no room above

const small = matchMedia("(max-width: 720px), (max-width: 960px) and (max-height: 500px)"), // as in small.css
  isSmall = signal(small.matches);
small.addEventListener("change", () => {
  isSmall.value = small.matches;
});

/** The picture whose pixels are shown: the stage's. */
export const loupePicture = /** @type {import("preact").RefObject<HTMLImageElement>} */ (
  createRef()
);

/** What the loupe looks at: the point that is held or selected, else the pointer. */
const target = computed(() => {
  if (!editing.value) return null;
  const at = pointer.value,
    last = selectedPoints.value.at(-1),
    point = last && pointsOf(doc.value, last.feature)[last.index];
  if (point && (at?.down || !at))
    return {
      x: point[0],
      y: point[1],
      touch: at?.touch ?? false,
      name: t("common.point-of", { feature: lineTitle(last.feature), number: last.index + 1 }),
    };
  return at && (!at.touch || at.down) ? { ...at, name: "" } : null;
});

/** What is drawn over its pixels. @param {{ x: number, y: number }} at @returns {{ lines: Line[], rings: Ring[] }} */
function marks(at) {
  const lines = Object.entries(curves.value).flatMap(([border, curve]) =>
    isCurve(curve) ? [{ points: curve.curve, colour: colour(border) }] : [],
  );
  const rings = doc.value.observations.flatMap(({ feature, points }) =>
    points.map((point) => ({ point, colour: colour(String(feature)) })),
  );
  const snap = snapPreview.value;
  return snap?.state === "snapped" && Math.hypot(snap.of[0] - at.x, snap.of[1] - at.y) < FRESH_PX
    ? { lines: [...lines, ...edges(snap)], rings: [...rings, { point: snap.point, colour: SNAP }] }
    : { lines, rings };
}

/** Beside the picture, at the head of the results. */
export function DockedLoupe() {
  const at = target.value;
  if (!editing.value || isSmall.value) return null;
  return html`<div class="loupe-dock">
    ${
      at && !at.touch
        ? html`
        <${Glass} picture=${loupePicture} at=${at} k=${view.value.k} ...${marks(at)} />
        ${at.name && html`<span>${at.name}</span>`}
      `
        : html`<p>${t("canvas.loupe.empty")}</p>`
    }
  </div>`;
}

/** Over the picture: above a finger, else in the corner that the target is far from. */
export function FloatingLoupe() {
  const at = target.value;
  if (!at || tool.value !== "pick" || !(at.touch || isSmall.value)) return null;
  return html`<${Glass} picture=${loupePicture} at=${at} place=${place(at)} k=${view.value.k} ...${marks(at)} />`;
}

/**
 * Where it floats, px of the stage.
 * @param {{ x: number, y: number, touch: boolean }} at
 */
function place(at) {
  const [sx, sy] = toStage(at.x, at.y),
    { width } = stageSize.value;
  const within = (/** @type {number} */ x) => Math.min(Math.max(8, x), width - SIZE_PX - 8),
    isRight = sx > width / 2;
  if (!at.touch) return { left: isRight && sy < 2 * SIZE_PX ? 8 : width - SIZE_PX - 8, top: 8 };
  const above = sy - FINGER_PX - SIZE_PX / 2;
  if (above >= 0) return { left: within(sx - SIZE_PX / 2), top: above };
  return {
    left: within(isRight ? sx - BESIDE_FINGER_PX - SIZE_PX : sx + BESIDE_FINGER_PX),
    top: 8,
  };
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
        /** @type {Point} */ ([
          x + along * ux - side * width_px * uy,
          y + along * uy + side * width_px * ux,
        ]),
    ),
  }));
}

/**
 * @typedef {import("../../core/types").Point} Point
 * @typedef {{ points: (Point | null)[], colour: string }} Line
 * @typedef {{ point: Point, colour: string }} Ring
 */

/**
 * A window on a picture's own pixels. at: picture pixels; place: stage pixels, where it floats; k: the stage's scale.
 * @param {{ picture: import("preact").RefObject<HTMLImageElement>, at: { x: number, y: number },
 * place?: { left: number, top: number }, k: number, lines: Line[], rings: Ring[] }} props
 */
export function Glass({ picture, at, place: float, k, lines, rings }) {
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  useEffect(() => {
    if (canvas.current && picture.current?.complete)
      draw(canvas.current, picture.current, at, Math.max(MIN_ZOOM, 2 * k), lines, rings);
  });
  return html`<canvas
    class=${float ? "loupe floating" : "loupe"}
    data-testid="loupe"
    ref=${canvas}
    style=${float && `left:${float.left}px;top:${float.top}px;width:${SIZE_PX}px;height:${SIZE_PX}px`}
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
  const ratio = devicePixelRatio,
    k = scale * ratio;
  canvas.width = canvas.clientWidth * ratio;
  canvas.height = canvas.clientHeight * ratio;
  const middle = /** @type {Point} */ ([canvas.width / 2, canvas.height / 2]);
  g.fillStyle = "#000";
  g.fillRect(0, 0, canvas.width, canvas.height);
  g.imageSmoothingEnabled = false;
  // Picture pixels, with (0, 0) the centre of the first one.
  g.setTransform(k, 0, 0, k, middle[0] - at.x * k, middle[1] - at.y * k);
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
  cross(g, middle, ratio);
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

/** @param {CanvasRenderingContext2D} g @param {Point} middle @param {number} ratio */
function cross(g, middle, ratio) {
  g.setTransform(1, 0, 0, 1, ...middle);
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
