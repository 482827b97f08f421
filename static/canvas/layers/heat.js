// Draws a map of millimetres over a picture, and marks its worst place.
import { useEffect, useRef } from "preact/hooks";
import { mm } from "../../core/format.js";
import { html } from "../../core/html.js";
import { t } from "../../core/words.js";
import { paneSize } from "../viewport.js";
import { shownMap } from "../../features/compare/heat.js";
import { STOPS, TOP_MM } from "../../ui/map_scale.js";

const LARGEST_PX = 900; // of the canvas: the grid knows no more, and the browser smooths the rest
const LABEL_PX = 130,
  LEGEND_PX = 110; // room for the words beside the mark, and for the legend below it
const PARTS = 3; // of a cell, each way: two triangles alone would show their seam

const SHADES = new Uint32Array(
  new Uint8ClampedArray(Array.from({ length: 1024 }, (_, i) => shade(i / 1023)).flat()).buffer,
);

/**
 * @typedef {import("../../core/types").Point} Point
 * @typedef {import("../../core/types").HeatMap} HeatMap
 * @typedef {[number, number, number]} Corner x, y, share of the scale
 */

/**
 * frame: of which picture; size: of that picture with its margin, px; x, y, k: where it lies on the stage, as its
 * <img>.
 * @param {{ frame: "corrected" | "image", size: Point, margin?: number, x: number, y: number, k: number }} props */
export function Heat({ frame, size: [width, height], margin = 0, x, y, k }) {
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const map = shownMap.value,
    density = Math.min(1, LARGEST_PX / Math.max(width, height));
  useEffect(() => {
    if (map && canvas.current) draw(canvas.current, map, map.at[frame], density, margin);
  }, [map, frame, density, margin]);
  if (!map) return null;
  const stage = paneSize.value,
    worst = map.at[frame].at(-1),
    sx = worst && x + (worst[0] + margin + 0.5) * k,
    sy = worst && y + (worst[1] + margin + 0.5) * k;
  return html`
    <canvas
      class="heat"
      data-testid=${`heat-${frame}`}
      ref=${canvas}
      width=${Math.ceil(width * density)}
      height=${Math.ceil(height * density)}
      style=${`transform:translate(${x}px,${y}px) scale(${k / density})`}
      aria-hidden="true"
    />
    ${
      sx &&
      sy &&
      html`<svg class="overlay worst" data-testid=${`worst-${frame}`} aria-hidden="true">
      <g transform=${`translate(${sx} ${sy})`}>
        <circle r="8" />
        <circle r="1.5" />
        <text
          x=${sx > stage.width - LABEL_PX ? -10 : 10}
          y=${sy < stage.height - LEGEND_PX ? 21 : -11}
          text-anchor=${sx > stage.width - LABEL_PX ? "end" : "start"}
        >
          ${t("canvas.heat.worst", { error: mm(map.worst_mm) })}
        </text>
      </g>
    </svg>`
    }
  `;
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {HeatMap} map
 * @param {(Point | null)[]} at of all places, row after row
 * @param {number} density
 * @param {number} margin
 */
function draw(canvas, { values }, at, density, margin) {
  const g = canvas.getContext("2d"),
    columns = values[0].length;
  if (!g) return;
  const image = g.createImageData(canvas.width, canvas.height);
  /** @param {number} r @param {number} c @returns {Corner | null} */
  const corner = (r, c) => {
    const p = at[r * columns + c],
      v = values[r][c];
    return p && v !== null
      ? [(p[0] + margin) * density, (p[1] + margin) * density, v / TOP_MM]
      : null;
  };
  for (let r = 0; r + 1 < values.length; r++)
    for (let c = 0; c + 1 < columns; c++) {
      const a = corner(r, c),
        b = corner(r, c + 1),
        d = corner(r + 1, c),
        e = corner(r + 1, c + 1);
      if (a && b && d && e) cell(image, a, b, d, e);
    }
  g.putImageData(image, 0, 0);
}

/**
 * One cell of the grid, between its corners: a b over d e.
 * @param {ImageData} image
 * @param {Corner} a
 * @param {Corner} b
 * @param {Corner} d
 * @param {Corner} e
 */
function cell(image, a, b, d, e) {
  /** @param {number} i @param {number} j @returns {Corner} */
  const between = (i, j) => {
    const p = j / PARTS,
      q = i / PARTS,
      mix = (/** @type {0 | 1 | 2} */ n) =>
        (a[n] * (1 - p) + b[n] * p) * (1 - q) + (d[n] * (1 - p) + e[n] * p) * q;
    return [mix(0), mix(1), mix(2)];
  };
  for (let i = 0; i < PARTS; i++)
    for (let j = 0; j < PARTS; j++) {
      triangle(image, between(i, j), between(i, j + 1), between(i + 1, j));
      triangle(image, between(i + 1, j + 1), between(i, j + 1), between(i + 1, j));
    }
}

/**
 * Fill a triangle, its colours running evenly from corner to corner.
 * @param {ImageData} image
 * @param {Corner} a
 * @param {Corner} b
 * @param {Corner} c
 */
function triangle(image, [ax, ay, av], [bx, by, bv], [cx, cy, cv]) {
  const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax),
    edge = -1e-9; // neighbours share their edge: no seam
  const pixels = new Uint32Array(image.data.buffer),
    from = (/** @type {number[]} */ v) => Math.max(0, Math.ceil(Math.min(...v))),
    to = (/** @type {number[]} */ v, /** @type {number} */ last) =>
      Math.min(last, Math.floor(Math.max(...v)));
  for (let y = from([ay, by, cy]); y <= to([ay, by, cy], image.height - 1); y++)
    for (let x = from([ax, bx, cx]); x <= to([ax, bx, cx], image.width - 1); x++) {
      const b = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area,
        c = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area;
      if (b >= edge && c >= edge && b + c <= 1 - edge)
        pixels[y * image.width + x] =
          SHADES[Math.round(1023 * Math.min(1, av * (1 - b - c) + bv * b + cv * c))];
    }
}

/** Between two of the stops. @param {number} share 0 to 1 @returns {number[]} red, green, blue, opacity, 0 to 255 */
function shade(share) {
  const at = share * (STOPS.length - 1),
    low = Math.min(Math.floor(at), STOPS.length - 2);
  return [
    ...[1, 3, 5].map((i) => {
      const [one, next] = [STOPS[low], STOPS[low + 1]].map((stop) =>
        Number.parseInt(stop.slice(i, i + 2), 16),
      );
      return one + (at - low) * (next - one);
    }),
    255,
  ];
}
