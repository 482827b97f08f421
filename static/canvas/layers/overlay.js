// Drawn over the raw picture while it is clicked: curves, points, the field's lines, the selection box.
import { computed } from "@preact/signals";
import { BORDERS, doc } from "../../core/document.js";
import { lineTitle, mm } from "../../core/format.js";
import { html } from "../../core/html.js";
import {
  active,
  box,
  editing,
  pointer,
  selectedPoints,
  showLines,
  snapshot,
  step,
  tool,
} from "../../core/state.js";
import { t } from "../../core/words.js";
import { colour, path, placed } from "../drawing.js";
import { LineSuggestions } from "./line_suggestions.js";
import { stageSize, toStage, view } from "../viewport.js";
import { curves, isCurve, preview, stale } from "../../features/calibrate/fitting.js";

const MARK_PX = 5.5,
  TICK_PX = 1.8, // of points so dense that marks would hide the line: detected ones
  DENSE_PX = 26, // between neighbours on one line, on the stage
  NEAR_PX = 40; // of the pointer: there they are marks again
const NAME_PX = 7, // width of a letter
  BENT_PX = 8; // farther from its chord, a line is an arc

/** @typedef {import("../../core/types").Point} Point */
const WORTH = 0.95; // a gain smaller than a twentieth is not worth a click
const LABEL_PX = 230; // room for the words beside it
const BEYOND_PX = 6; // a curve is bold from its first to its last point, and a little further

export function Overlay() {
  const picture = snapshot.value;
  return html`<svg class="overlay" aria-hidden="true">
    ${
      (showLines.value || step.value === "field") &&
      picture &&
      html`<${FieldLines}
      name="on-raw"
      size=${[picture.width, picture.height]}
      features=${preview.value?.overlay ?? []}
      transform=${placed(view.value.tx, view.value.ty, view.value.k)}
    />`
    }
    ${editing.value && html`<${LineSuggestions} />`}
    <${Curves} />
    ${
      editing.value &&
      html`
      <${NextClick} />
      <${Points} />
      <${NearPointer} />
      <${Box} />
    `
    }
  </svg>`;
}

/** What is painted on the field, as the model sees it; the borders on top. size: of the picture, which clips it.
 * @param {{ features: import("../../core/types").Feature[], transform: string, size: Point,
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
 * @param {Point[]} points
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

/** @param {{ feature: string, kind: string, points: Point[] }} props */
function FeaturePoints({ feature, kind, points }) {
  const curve = curves.value[/** @type {import("../../core/types").Border} */ (feature)];
  const strays = new Set(
    isCurve(curve) && curve.points.length === points.length ? curve.outliers : [],
  );
  const isDense = areDense(points),
    isNamed = feature === active.value || BORDERS.includes(/** @type {any} */ (feature)),
    label = isNamed ? labelPlace(points, lineTitle(feature).length * NAME_PX) : null;
  return html`<g class=${feature === active.value ? "points active" : "points"} style=${`--colour:${colour(feature)}`}>
    ${points.map((p, index) => {
      const [x, y] = toStage(...p);
      const isStray = strays.has(index),
        isPicked = selectedPoints.value.some((q) => q.feature === feature && q.index === index);
      return html`<g
        key=${index}
        transform=${`translate(${x} ${y})`}
        class=${`point${isPicked ? " picked" : ""}${isStray ? " stray" : isDense && !isPicked ? " tick" : ""}`}
        data-point=${`${feature}:${index}`}
      >
        ${isPicked && html`<circle class="ring" r="9.5" />`}
        ${
          kind === "landmark"
            ? html`<path class="mark" d="M0 -7L7 0L0 7L-7 0Z" />`
            : html`<circle class="mark" r=${isDense && !isPicked ? TICK_PX : MARK_PX} />`
        }
        ${
          isStray &&
          html`
          <path class="cross" d="M-5 -5L5 5M-5 5L5 -5" />
          <text x="12" y="4">
            ${t("canvas.overlay.stray")}
          </text>
        `
        }
      </g>`;
    })}
    ${
      label &&
      html`<text class="name" x=${label.x} y=${label.y} text-anchor=${label.anchor}>
      ${lineTitle(feature)}
    </text>`
    }
  </g>`;
}

/** Whether marks would touch each other and hide their line. @param {Point[]} points */
const areDense = (points) =>
  points.reduce(
    (sum, [x, y], i) => (i ? sum + Math.hypot(x - points[i - 1][0], y - points[i - 1][1]) : 0),
    0,
  ) *
    view.value.k <
  DENSE_PX * (points.length - 1);

/** Dense points about the pointer, as the marks that a press would take. */
function NearPointer() {
  const at = pointer.value;
  if (!at || tool.value !== "pick") return null;
  const reach = NEAR_PX / view.value.k;
  return html`<g class="near">
    ${doc.value.observations.flatMap(({ feature, points }) =>
      areDense(points)
        ? points
            .filter(([x, y]) => Math.hypot(x - at.x, y - at.y) < reach)
            .map((p) => {
              const [x, y] = toStage(...p);
              return html`<circle
                key=${p}
                cx=${x}
                cy=${y}
                r=${MARK_PX}
                style=${`--colour:${colour(String(feature))}`}
              />`;
            })
        : [],
    )}
  </g>`;
}

/**
 * Where a line's name stands: beside it, never on it, on the side that it bulges to, else on the outer one; not out of
 * the stage. Not at its middle, where other lines cross.
 * @param {Point[]} points
 * @param {number} width of the name, px
 */
function labelPlace(points, width) {
  if (points.length === 0) return null;
  const third = Math.floor(points.length / 3),
    [x, y] = toStage(...points[third]),
    [x0, y0] = toStage(...points[Math.max(0, third - 1)]),
    [x1, y1] = toStage(...points[Math.min(points.length - 1, third + 1)]);
  const size = stageSize.value,
    isUpright = Math.abs(y1 - y0) > Math.abs(x1 - x0),
    [bulgeX, bulgeY] = fromChord(
      [x, y],
      toStage(...points[0]),
      toStage(...points[points.length - 1]),
    );
  const bulge = isUpright ? bulgeX : bulgeY,
    outer = isUpright ? x - size.width / 2 : y - size.height / 2;
  let side = Math.sign(Math.abs(bulge) > BENT_PX ? bulge : outer) || 1;
  if (isUpright) {
    if (x + side * (12 + width) < 0 || x + side * (12 + width) > size.width) side = -side;
    return { x: x + 12 * side, y: y + 4, anchor: side > 0 ? "start" : "end" };
  }
  if (y + side * 26 < 0 || y + side * 26 > size.height) side = -side;
  return { x, y: side > 0 ? y + 21 : y - 12, anchor: "middle" };
}

/**
 * How far a point lies from the chord between two others: px across it.
 * @param {Point} p
 * @param {Point} a
 * @param {Point} b
 */
function fromChord([x, y], [ax, ay], [bx, by]) {
  const length = Math.hypot(bx - ax, by - ay) || 1,
    [ux, uy] = [(bx - ax) / length, (by - ay) / length],
    along = (x - ax) * ux + (y - ay) * uy;
  return [x - ax - along * ux, y - ay - along * uy];
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
      ${t("canvas.overlay.next-click", { worst: mm(next.worst_mm), worstThen: mm(next.worst_mm_then) })}
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
