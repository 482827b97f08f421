// Draws detections over the picture: rings, headings, numbers and field positions.
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { path } from "../../../canvas/drawing.js";
import { detectionState } from "../detection.js";
import { correctedOf, fieldPositions, pixelsPerMm } from "../field_positions.js";

/** @typedef {import("../types").Item} Item @typedef {import("../../../core/types").Point} Point */

const CORNERS = 24; // of a ring
const ROBOT_MM = 90,
  SMALL_ROBOT_MM = 40,
  SMALL_HAT_MM = 100; // half across; robots lower than that are small
const BY_DOT = 3.6,
  BY_PATCHES = 1.5; // a robot's ring beside its team's dot, or its patches, where no calibration tells sizes

/**
 * corrected: in pixels of the corrected picture.
 * @param {{ items: Item[], corrected: boolean, size: number, labels: boolean }} props size: of letters, picture px
 */
export function DetectionMarks({ items, corrected, size, labels }) {
  const map = fieldPositions.value;
  if (corrected && !map) return null;
  /** @param {Point} p @returns {Point | null} */
  const to = (p) => (corrected && map ? correctedOf(map, p) : p);
  return items.map((item, i) => {
    const at = to(item.pixel),
      mark = shapeOf(item, map);
    if (!at) return null;
    const ring = `${path(mark.ring.map(to))}Z`,
      front = mark.front && path([at, to(mark.front)]);
    const top = Math.min(...mark.ring.map(to).map((p) => p?.[1] ?? at[1]));
    return html`<g
      key=${i}
      class="seen-mark"
      data-team=${item.kind === "ball" ? "ball" : (item.team ?? "")}
      data-testid=${`mark-${item.kind}`}
    >
      <path class="casing" d=${ring} />
      <path d=${ring} />
      ${
        front &&
        html`
        <path class="casing" d=${front} />
        <path d=${front} />
      `
      }
      ${
        (item.kind === "robot" || labels) &&
        html`<text x=${at[0]} y=${top - size / 3} font-size=${size} stroke-width=${size / 4}>
          ${item.kind === "robot" ? nameOf(item) : ""}
          ${labels && item.x_mm !== null ? ` ${number(item.x_mm, 0)}, ${number(item.y_mm, 0)}` : ""}
        </text>`
      }
    </g>`;
  });
}

/** "Y3", "B?": readable without colours. @param {Item} item */
export const nameOf = (item) => `${(item.team ?? "").charAt(0).toUpperCase()}${item.id ?? "?"}`;

/**
 * Ring and front in raw pixels.
 * @param {Item} item
 * @param {import("../field_positions.js").Places | null} map
 * @returns {{ ring: Point[], front: Point | null }}
 */
function shapeOf(item, map) {
  const [x, y] = item.pixel,
    way = map && item.kind === "robot" ? pixelsPerMm(map, item.pixel) : null;
  const r_mm = (map?.hat_mm ?? 0) < SMALL_HAT_MM ? SMALL_ROBOT_MM : ROBOT_MM;
  const isDot =
    item.kind === "robot" && detectionState.value?.plan.stages.some((s) => s.stage === "butterfly");
  const r_px = Math.max(4, Math.sqrt(item.area_px / Math.PI) * (isDot ? BY_DOT : BY_PATCHES));
  const turns = Array.from({ length: CORNERS }, (_, i) => (2 * Math.PI * i) / CORNERS);
  /** @param {number} angle @returns {Point} */
  const at = (angle) => {
    const [dx, dy] = way
      ? way(r_mm * Math.cos(angle), r_mm * Math.sin(angle))
      : [r_px * Math.cos(angle), -r_px * Math.sin(angle)]; // without a calibration y goes up the picture
    return [x + dx, y + dy];
  };
  const turned = item.orientation_deg === null ? null : (item.orientation_deg * Math.PI) / 180;
  return { ring: turns.map(at), front: turned === null ? null : at(turned) };
}
