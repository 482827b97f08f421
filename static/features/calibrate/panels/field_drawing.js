// The little field: the region as it stands in the corrected picture, its borders coloured, and clickable.
import { BORDERS, doc, pointsOf } from "../../../core/document.js";
import { areaName, lineName, lineTitle } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { active, editing, field, region, rotation } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { colour } from "../../../canvas/drawing.js";
import { activateFeature } from "../editing.js";
import { arcPoints, lineUnder, rectOf, sideOf, turned } from "../field_sides.js";
import { preview, refusal, stale } from "../fitting.js";

/**
 * @typedef {import("../../../core/types").Point} Point
 * @typedef {import("../../../core/types").Border} Border
 * @typedef {{ x: number, y: number, width: number, height: number }} Rect
 */

export function FieldDrawing() {
  const f = field.value,
    r = region.value,
    deg = rotation.value;
  if (!f || !r) return null;
  const rect = rectOf(r, deg),
    margin = 0.11 * Math.max(rect.width, rect.height);
  const unit = (Math.max(rect.width, rect.height) + 2 * margin) / 230; // one screen pixel, about
  const place = (/** @type {Point} */ p) => turned(p, deg).join(" ");
  const borders = new Set(BORDERS.map(lineUnder));
  return html`<svg
    class="field"
    data-testid="field-drawing"
    role="group"
    aria-label=${`${f.title}, ${areaName(r.name)}`}
    viewBox=${`${rect.x - margin} ${rect.y - margin} ${rect.width + 2 * margin} ${rect.height + 2 * margin}`}
    style=${`--unit:${unit}px`}
  >
    <rect class="carpet" x=${rect.x} y=${rect.y} width=${rect.width} height=${rect.height} />
    <clipPath id="in-view">
      <rect x=${rect.x} y=${rect.y} width=${rect.width} height=${rect.height} />
    </clipPath>
    <g class="inside" clip-path="url(#in-view)">
      ${f.lines
        .filter((l) => !borders.has(l.name))
        .map(
          (l) =>
            html`<${Feature} key=${l.name} name=${l.name} d=${`M${place(l.from)}L${place(l.to)}`} />`,
        )}
      ${f.arcs.map(
        (a) =>
          html`<${Feature} key=${a.name} name=${a.name} d=${`M${arcPoints(a).map(place).join("L")}`} />`,
      )}
    </g>
    ${Object.entries(f.landmarks)
      .filter(([, p]) => isIn(rect, turned(p, deg)))
      .map(
        ([name, p]) =>
          html`<${Spot} key=${name} name=${name} at=${turned(p, deg)} r=${3.2 * unit} />`,
      )}
    ${BORDERS.map((border) => {
      const [[x1, y1], [x2, y2]] = sideOf(rect, border),
        isDown = x1 === x2,
        out = 11 * unit;
      const [tx, ty] = isDown
        ? [x1 + (border === "left" ? -out : out), (y1 + y2) / 2]
        : [(x1 + x2) / 2, y1 + (border === "top" ? -out : out)];
      return html`<g
        key=${border}
        class=${`border${active.value === border ? " active" : ""}${stateClass(border)}`}
        style=${`--colour:${colour(border)}`}
        role="button"
        tabindex="0"
        aria-label=${t("calibrate.click", { feature: lineName(border) }) + done(border)}
        aria-pressed=${active.value === border}
        data-testid=${`field-${border}`}
        onClick=${() => activateFeature(border)}
        onKeyDown=${onEnter(border)}
      >
        <path class="hit" d=${`M${x1} ${y1}L${x2} ${y2}`} />
        <path class="line" d=${`M${x1} ${y1}L${x2} ${y2}`} />
        <text x=${tx} y=${ty} font-size=${11 * unit}>
          ${lineTitle(border)[0]}
        </text>
        <title>
          ${lineTitle(border)}
          ${done(border)}
        </title>
      </g>`;
    })}
  </svg>`;
}

/** A painted line or arc; one can click its points too. @param {{ name: string, d: string }} props */
function Feature({ name, d }) {
  return html`<g
    class=${`painted${active.value === name ? " active" : ""}${stateClass(name)}`}
    data-testid=${`field-${name}`}
    role="button"
    tabindex=${editing.value ? 0 : -1}
    aria-label=${t("calibrate.click", { feature: lineName(name) }) + done(name)}
    aria-pressed=${active.value === name}
    onClick=${() => editing.value && activateFeature(name)}
    onKeyDown=${onEnter(name)}
  >
    <path class="hit" d=${d} />
    <path class="line" d=${d} />
    <title>
      ${lineTitle(name)}
      ${done(name)}
    </title>
  </g>`;
}

/**
 * A single spot; it is drawn once it has been clicked or chosen, and can be found with the pointer.
 * @param {{ name: string, at: Point, r: number }} props
 */
function Spot({ name, at: [x, y], r }) {
  return html`<g
    class=${`spot${active.value === name ? " active" : ""}${stateClass(name)}`}
    data-testid=${`field-${name}`}
    role="button"
    tabindex="-1"
    aria-label=${t("calibrate.click", { feature: lineName(name) }) + done(name)}
    aria-pressed=${active.value === name}
    onClick=${() => editing.value && activateFeature(name)}
  >
    <circle class="hit" cx=${x} cy=${y} r=${1.6 * r} />
    <circle class="dot" cx=${x} cy=${y} r=${r} />
    <title>
      ${lineTitle(name)}
      ${done(name)}
    </title>
  </g>`;
}

/** @param {Rect} r @param {Point} p */
const isIn = (r, [x, y]) =>
  x >= r.x - 1 && x <= r.x + r.width + 1 && y >= r.y - 1 && y <= r.y + r.height + 1;

/** How far a feature is: nothing, clicked, or part of the fit. @param {string} name */
function stateClass(name) {
  if (!pointsOf(doc.value, name).length) return "";
  const row = refusal.value
    ? undefined
    : preview.value?.report.per_feature.find((f) => f.feature === name);
  return row ? ` clicked ${row.used ? "used" : "checks"}` : " clicked";
}

/** The same in words. @param {string} name */
function done(name) {
  const count = pointsOf(doc.value, name).length,
    how = stateClass(name);
  if (!count) return "";
  const part = how.endsWith("used")
    ? t("calibrate.field-drawing.used")
    : how.endsWith("checks")
      ? t("calibrate.field-drawing.checks")
      : "";
  const fitting = stale.value ? t("calibrate.field-drawing.fitting") : "";
  return t("calibrate.field-drawing.points", { count }) + part + fitting;
}

/** @param {string} feature */
const onEnter = (feature) => (/** @type {KeyboardEvent} */ e) => {
  if (e.key !== "Enter" && e.key !== " ") return;
  e.preventDefault();
  activateFeature(feature);
};
