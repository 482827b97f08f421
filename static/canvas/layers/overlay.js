// Drawn over the raw picture while it is clicked: curves, points, the field's lines, the selection box.
import { computed } from "@preact/signals";
import { BORDERS, doc } from "../../core/document.js";
import { mm, words } from "../../core/format.js";
import { html } from "../../core/html.js";
import { active, box, editing, selectedPoints, showLines, snapshot } from "../../core/state.js";
import { colour, path, placed } from "../drawing.js";
import { LineSuggestions } from "./line_suggestions.js";
import { stageSize, toStage, view } from "../viewport.js";
import { curves, isCurve, preview, stale } from "../../features/calibrate/fitting.js";

const MARK_PX = 5.5,
  TICK_PX = 2, // of points so dense that marks would hide the line: detected ones
  DENSE = 15; // on one line
const WORTH = 0.95; // a gain smaller than a twentieth is not worth a click
const LABEL_PX = 230; // room for the words beside it
const BEYOND_PX = 6; // a curve is bold from its first to its last point, and a little further

export function Overlay() {
  const picture = snapshot.value;
  return html`<svg class="overlay" aria-hidden="true">
    ${showLines.value && picture && html`<${FieldLines}
      name="on-raw"
      size=${[picture.width, picture.height]}
      features=${preview.value?.overlay ?? []}
      transform=${placed(view.value.tx, view.value.ty, view.value.k)}
    />`}
    ${editing.value && html`<${LineSuggestions} />`}
    <${Curves} />
    ${editing.value && html`
      <${NextClick} />
      <${Points} />
      <${Box} />
    `}
  </svg>`;
}

/** What is painted on the field, as the model sees it; the borders on top. size: of the picture, which clips it.
 * @param {{ features: import("../../core/types").Feature[], transform: string, size: import("../../core/types").Point,
 * name: string }} props */
export function FieldLines({ features, transform, size: [width, height], name }) {
  const drawn = features
    .filter((f) => f.points.length > 1)
    .toSorted((a, b) => Number(a.kind === "border") - Number(b.kind === "border"))
    .map((f) => ({
      key: f.kind + f.feature,
      d: path(f.points),
      style: f.kind === "border" ? `stroke:${colour(f.feature)}` : "",
    }));
  return html`<g class="field-lines" data-testid="field-lines" transform=${transform} clip-path=${`url(#${name})`}>
    <clipPath id=${name}>
      <rect x="-.5" y="-.5" width=${width} height=${height} />
    </clipPath>
    ${drawn.map(({ key, d }) => html`<path key=${key} class="casing" d=${d} />`)}
    ${drawn.map(({ key, d, style }) => html`<path key=${key} d=${d} style=${style} />`)}
  </g>`;
}

const paths = computed(() =>
  BORDERS.flatMap((border) => {
    const curve = curves.value[border];
    return isCurve(curve) ? [{ border, curve, d: path(curve.curve) }] : [];
  }),
);

function Curves() {
  const { k, tx, ty } = view.value;
  return html`<g transform=${placed(tx, ty, k)}>
    ${paths.value.map(({ border, curve, d }) => {
      const clip = between(border, curve.points, BEYOND_PX / k);
      return html`<g
        key=${border}
        class=${border === active.value ? "curve active" : "curve"}
        style=${`--colour:${colour(border)}`}
      >
        <clipPath id=${`span-${border}`}>
          <rect ...${clip} />
        </clipPath>
        <path class="extended" d=${d} />
        <path class="casing" d=${d} clip-path=${`url(#span-${border})`} />
        <path class="line" data-testid=${`curve-${border}`} d=${d} clip-path=${`url(#span-${border})`} />
      </g>`;
    })}
  </g>`;
}

/**
 * The part of the picture between a border's outermost points.
 * @param {import("../../core/types").Border} border
 * @param {import("../../core/types").Point[]} points
 * @param {number} more
 */
function between(border, points, more) {
  const { width, height } = snapshot.value ?? { width: 0, height: 0 };
  const run = border === "left" || border === "right" ? 1 : 0;
  const from = Math.min(...points.map((p) => p[run])) - more,
    length = Math.max(...points.map((p) => p[run])) + more - from;
  return run
    ? { x: -width, width: 3 * width, y: from, height: length }
    : { y: -height, height: 3 * height, x: from, width: length };
}

function Points() {
  void view.value;
  return html`<g>
    ${doc.value.observations.map(
      ({ feature, kind, points }) =>
        typeof feature === "string" && 
          html`<${FeaturePoints} key=${feature} feature=${feature} kind=${kind} points=${points} />`,
    )}
  </g>`;
}

/** @param {{ feature: string, kind: string, points: import("../../core/types").Point[] }} props */
function FeaturePoints({ feature, kind, points }) {
  const curve = curves.value[/** @type {import("../../core/types").Border} */ (feature)];
  const strays = new Set(isCurve(curve) && curve.points.length === points.length ? curve.outliers : []);
  const label = labelPlace(points),
    isDense = points.length > DENSE;
  return html`<g class=${feature === active.value ? "points active" : "points"} style=${`--colour:${colour(feature)}`}>
    ${points.map((p, index) => {
      const [x, y] = toStage(...p);
      const isPicked = selectedPoints.value.some((q) => q.feature === feature && q.index === index);
      return html`<g
        key=${index}
        transform=${`translate(${x} ${y})`}
        class=${`point${isPicked ? " picked" : ""}${strays.has(index) ? " stray" : ""}`}
        data-point=${`${feature}:${index}`}
      >
        ${isPicked && html`<circle class="ring" r="9.5" />`}
        ${kind === "landmark"
          ? html`<path class="mark" d="M0 -7L7 0L0 7L-7 0Z" />`
          : html`<circle class="mark" r=${isDense && !isPicked ? TICK_PX : MARK_PX} />`}
        ${strays.has(index) && html`
          <path class="cross" d="M-5 -5L5 5M-5 5L5 -5" />
          <text x="12" y="4">
            stray
          </text>
        `}
      </g>`;
    })}
    ${label && html`<text class="name" x=${label[0]} y=${label[1]}>
      ${words(feature)}
    </text>`}
  </g>`;
}

/** Beside the middle one of a feature's points. @param {import("../../core/types").Point[]} points */
function labelPlace(points) {
  if (points.length === 0) return null;
  const [x, y] = toStage(...points[points.length >> 1]);
  return [x + 12, y - 10];
}

/** Where one more click would help most, and what it would gain. */
function NextClick() {
  const next = stale.value ? null : preview.value?.report.next_click;
  if (!next || next.worst_mm_then > WORTH * next.worst_mm) return null;
  const [x, y] = toStage(...next.point),
    isFarRight = x > stageSize.value.width - LABEL_PX;
  return html`<g class="next-click" data-testid="next-click" transform=${`translate(${x} ${y})`}>
    <circle r="10" />
    <text x=${isFarRight ? -15 : 15} y="4" text-anchor=${isFarRight ? "end" : "start"}>
      next best click: ${mm(next.worst_mm)} → ${mm(next.worst_mm_then)} mm
    </text>
  </g>`;
}

function Box() {
  if (!box.value) return null;
  const { x0, y0, x1, y1 } = box.value;
  return html`<rect
    class="box"
    x=${Math.min(x0, x1)}
    y=${Math.min(y0, y1)}
    width=${Math.abs(x1 - x0)}
    height=${Math.abs(y1 - y0)}
  />`;
}
