// A field from above: its markings or its picture, areas on it, and labels over them that do not cover each other.
import { useLayoutEffect, useRef } from "preact/hooks";
import { html } from "../core/html.js";

const MARGIN_MM = 300,
  WIDTH = 1200; // as a rig's stitched picture has them: nothing moves when that takes the place of the markings
const GAP_PX = 3,
  EDGE = 30, // of the field's length: so much carpet is around a field without a picture
  INSET_PX = 8; // of what is absent: two cameras may cover the same area

/**
 * @typedef {import("../core/types").Point} Point
 * @typedef {{ x: number[], y: number[] }} Area smallest and largest, field mm
 * @typedef {{ width: number, height: number, k: number, x0: number, y0: number }} Frame
 *   k: its pixels a millimetre of the field; x0, y0: field mm at the top left
 * @typedef {{ key: string, at: Point, text: unknown, level?: string | null, testid?: string }} Label
 */

/** A field as it is drawn without a picture.
 * @param {import("../core/types").Field} field @param {number} [margin] mm @returns {Frame} */
export function frameOf({ length_mm, width_mm }, margin = MARGIN_MM) {
  const k = WIDTH / (length_mm + 2 * margin);
  return {
    width: WIDTH,
    height: Math.round((width_mm + 2 * margin) * k),
    k,
    x0: -length_mm / 2 - margin,
    y0: width_mm / 2 + margin,
  };
}

/** Field mm to pixels of the drawing. @param {Frame} frame @returns {(at: Point) => Point} */
export const placeIn =
  ({ k, x0, y0 }) =>
  ([x, y]) => [(x - x0) * k, (y0 - y) * k];

/** @param {Area} area @returns {Point} */
export const middleOf = ({ x, y }) => [(x[0] + x[1]) / 2, (y[0] + y[1]) / 2];

/** The outline of an area as an SVG path, so much smaller on each side. A path: an area may be a line.
 * @param {Area} area @param {(at: Point) => Point} place @param {number} [less] px */
export function outline({ x, y }, place, less = 0) {
  const [left, top] = place([x[0], y[1]]),
    [right, bottom] = place([x[1], y[0]]);
  return `M${left + less} ${top + less}H${right - less}V${bottom - less}H${left + less}Z`;
}

/**
 * @param {{ frame: Frame, label: string, labels: Label[], picture?: string, alt?: string, testid?: string,
 *   children?: unknown }} props picture: its address; children: SVG in the frame's pixels
 */
export function FieldPlan({
  frame: { width, height, ...rest },
  label,
  labels,
  picture,
  alt = "",
  testid,
  children,
}) {
  const place = placeIn({ width, height, ...rest }),
    box = useRef(/** @type {HTMLElement | null} */ (null));
  useLayoutEffect(() => keepApart(box.current));
  useLayoutEffect(() => {
    const watch = new ResizeObserver(() => keepApart(box.current));
    if (box.current) watch.observe(box.current);
    return () => watch.disconnect();
  }, []);
  return html`<div class="field-plan" ref=${box}>
    ${picture && html`<img data-testid="stitched" src=${picture} width=${width} height=${height} alt=${alt} />`}
    <svg viewBox=${`-0.5 -0.5 ${width} ${height}`} data-testid=${testid} role="img" aria-label=${label}>
      <defs>
        <pattern id="hatch" width="14" height="14" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">
          <path d="M0 0V14" />
        </pattern>
      </defs>
      ${!picture && html`<rect class="carpet" width=${width} height=${height} />`} ${children}
    </svg>
    ${labels.map(({ key, at, text, level, testid: id }) => {
      const [x, y] = place(at);
      return html`<div
        key=${key}
        class="said"
        data-testid=${id}
        data-level=${level}
        style=${`left:${(100 * x) / width}%;top:${(100 * y) / height}%`}
      >
        ${text}
      </div>`;
    })}
  </div>`;
}

/**
 * A field with areas on it, each with its label in the middle; an absent one is hatched.
 * @param {{ field: import("../core/types").Field, label: string,
 *   areas: (Omit<Label, "at"> & { area: Area, isAbsent?: boolean })[] }} props
 */
export function FieldAreas({ field, label, areas }) {
  const frame = frameOf(field, field.length_mm / EDGE),
    place = placeIn(frame);
  return html`<${FieldPlan}
    frame=${frame}
    label=${label}
    labels=${areas.map(({ area, ...rest }) => ({ ...rest, at: middleOf(area) }))}
  >
    ${areas.map(
      ({ key, area, level, isAbsent }) =>
        html`<path
          key=${key}
          class=${`area${isAbsent ? " absent" : ""}`}
          data-level=${level}
          d=${outline(area, place, isAbsent ? INSET_PX : 0)}
        />`,
    )}
    <${Markings} field=${field} place=${place} />
  <//>`;
}

/** All that is painted. @param {{ field: import("../core/types").Field, place: (at: Point) => Point }} props */
export const Markings = ({ field: { lines, arcs }, place }) => html`<g class="paint">
  ${lines.map((l) => html`<path key=${l.name} d=${`M${place(l.from)}L${place(l.to)}`} />`)}
  ${arcs.map((a) => html`<path key=${a.name} d=${arc(a, place)} />`)}
</g>`;

/** In two halves: SVG draws no arc that ends where it starts.
 * @param {import("../core/types").Arc} arc @param {(at: Point) => Point} place */
function arc({ centre: [x, y], radius_mm: r, start_deg, end_deg }, place) {
  const along = (/** @type {number} */ share) => {
    const angle = ((start_deg + (end_deg - start_deg) * share) * Math.PI) / 180;
    return place([x + r * Math.cos(angle), y + r * Math.sin(angle)]);
  };
  const px = place([r, 0])[0] - place([0, 0])[0],
    half = `A${px} ${px} 0 0 0 `;
  return `M${along(0)}${half}${along(0.5)}${half}${along(1)}`;
}

/** Each label at its place, within the drawing, or as near above or below as those before it let it.
 * @param {HTMLElement | null} box */
function keepApart(box) {
  if (!box) return;
  const within = box.getBoundingClientRect(),
    placed = /** @type {DOMRect[]} */ ([]);
  for (const said of /** @type {NodeListOf<HTMLElement>} */ (box.querySelectorAll(".said"))) {
    said.style.translate = "-50% -50%";
    const { x, y, width, height } = said.getBoundingClientRect();
    const left = Math.max(within.left, Math.min(x, within.right - width)),
      others = placed.filter((other) => left < other.right && other.left < left + width);
    const isFree = (/** @type {number} */ top) =>
      top >= within.top &&
      top + height <= within.bottom &&
      others.every((other) => top >= other.bottom || top + height <= other.top);
    const [top = y] = [y, ...others.flatMap((o) => [o.bottom + GAP_PX, o.top - GAP_PX - height])]
      .filter(isFree)
      .toSorted((a, b) => Math.abs(a - y) - Math.abs(b - y));
    said.style.translate = `calc(-50% + ${left - x}px) calc(-50% + ${top - y}px)`;
    placed.push(new DOMRect(left, top, width, height));
  }
}
