// Draws residual arrows: on a canvas, for there may be thousands.
import { useEffect, useRef } from "preact/hooks";
import { html } from "../../core/html.js";
import { editing } from "../../core/state.js";
import { paneSize, view } from "../viewport.js";
import { stale } from "../../features/calibrate/fitting.js";
import { factor, longest, shownArrows } from "../../features/compare/residual_arrows.js";

const FINE = "#fff",
  WARN = "#f2b84b",
  CASING = "#000a"; // the same on light and dark pages: below them lies the picture
const MIN_PX = 0.5; // on the stage; a shorter one is a click on the curve
const CROWD = 400; // more of them are drawn thinner, and bare: a casing costs as much as they do
const HEAD_PX = 7,
  BAR_PX = 5;

/**
 * @typedef {import("../../core/types").Arrow} Arrow
 * @typedef {{ x: number, y: number, dx: number, dy: number, length: number, cut: boolean }} Shaft on the stage; dx, dy:
 * of length 1
 */

/** frame: of which picture; x, y, k: where it lies on the stage, as its <img>.
 * @param {{ frame: "corrected" | "image", x: number, y: number, k: number }} props */
export function ResidualArrows({ frame, x, y, k }) {
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const all = shownArrows.value?.[frame]?.arrows,
    times = factor.value,
    most = longest.value * view.value.k,
    { width, height } = paneSize.value;
  const ratio = devicePixelRatio;
  useEffect(() => {
    if (all && canvas.current)
      draw(canvas.current, ratio, all, (arrow) => shaft(arrow, x, y, k, times, most));
  }, [all, times, most, x, y, k, width, height, ratio]);
  if (!all) return null;
  return html`<canvas
    class=${`arrows${editing.value && stale.value ? " stale" : ""}`}
    data-testid=${`arrows-${frame}`}
    ref=${canvas}
    width=${Math.round(width * ratio)}
    height=${Math.round(height * ratio)}
    aria-hidden="true"
  />`;
}

/**
 * @param {Arrow} arrow
 * @param {number} x
 * @param {number} y
 * @param {number} k
 * @param {number} times
 * @param {number} most
 * @returns {Shaft | null}
 */
function shaft({ point, foot }, x, y, k, times, most) {
  if (!point || !foot) return null; // out of the model's reach
  const across = foot[0] - point[0],
    down = foot[1] - point[1],
    px = Math.hypot(across, down),
    length = px * k * times;
  if (length < MIN_PX) return null;
  return {
    x: x + (point[0] + 0.5) * k,
    y: y + (point[1] + 0.5) * k,
    dx: across / px,
    dy: down / px,
    length: Math.min(length, most),
    cut: length > most,
  };
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {number} ratio
 * @param {Arrow[]} all
 * @param {(arrow: Arrow) => Shaft | null} of
 */
function draw(canvas, ratio, all, of) {
  const g = canvas.getContext("2d");
  if (!g) return;
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, canvas.width, canvas.height);
  g.lineCap = "round";
  for (const [outlier, colour] of /** @type {[boolean, string][]} */ ([
    [false, FINE],
    [true, WARN],
  ])) {
    const path = new Path2D();
    for (const arrow of all) if (arrow.outlier === outlier) trace(path, of(arrow));
    if (all.length <= CROWD) stroke(g, path, CASING, 4);
    stroke(g, path, colour, all.length > CROWD ? 1 : 1.8);
  }
}

/** @param {CanvasRenderingContext2D} g @param {Path2D} path @param {string} colour @param {number} width */
function stroke(g, path, colour, width) {
  g.strokeStyle = colour;
  g.lineWidth = width;
  g.stroke(path);
}

/** A line with a head; one that is cut ends in two bars. @param {Path2D} path @param {Shaft | null} line */
function trace(path, line) {
  if (!line) return;
  const { x, y, dx, dy, length, cut } = line,
    ex = x + length * dx,
    ey = y + length * dy;
  path.moveTo(x, y);
  path.lineTo(ex, ey);
  /** @param {number} back @param {number} side @param {"moveTo" | "lineTo"} pen */
  const at = (back, side, pen) => path[pen](ex - back * dx - side * dy, ey - back * dy + side * dx);
  if (cut) {
    for (const back of [0, 4]) {
      at(back, -BAR_PX, "moveTo");
      at(back, BAR_PX, "lineTo");
    }
    return;
  }
  const head = Math.min(HEAD_PX, 0.5 * length);
  at(head, -0.55 * head, "moveTo");
  path.lineTo(ex, ey);
  at(head, 0.55 * head, "lineTo");
}
