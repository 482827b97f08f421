// How far each click lies from its curve: one bar a point, border after border; a bar selects its point.
import { arrows } from "../arrows.js";
import { BORDERS } from "../document.js";
import { select } from "../editing.js";
import { curves, isCurve } from "../fitting.js";
import { number } from "../format.js";
import { html } from "../html.js";
import { colour } from "../layers/drawing.js";
import { picked } from "../state.js";
import { ActionButton } from "./toolbar.js";
import { Title } from "./title.js";

const WIDTH = 320, HEIGHT = 84, GAP = 8;

export function Residuals() {
  const groups = BORDERS.flatMap((border) => {
    const curve = curves.value[border];
    return isCurve(curve) ? [{ border, bars: inOrder(border, curve) }] : [];
  });
  const all = groups.flatMap(({ bars }) => bars.map((b) => Math.abs(b.px)));
  if (!all.length) return null;
  const top = roundUp(Math.max(...all)), step = (WIDTH - GAP * (groups.length - 1)) / all.length, y = (/** @type {number} */ px) => (HEIGHT / 2) * (1 - px / top);
  const digits = top < 0.1 ? 2 : 1;
  let x = -GAP;
  return html`<section aria-label="Residuals"><${Title} of="residuals">Residuals, px<//>
    <svg class="residuals" data-testid="residuals" viewBox=${`0 0 ${WIDTH + 34} ${HEIGHT}`} role="img" aria-label=${`Residuals of ${all.length} points, at most ${number(Math.max(...all), 2)} px`}>
      <path class="axis" d=${`M0 ${HEIGHT / 2}H${WIDTH}M0 1H${WIDTH}M0 ${HEIGHT - 1}H${WIDTH}`}/>
      <text x=${WIDTH + 4} y="9">+${number(top, digits)}</text><text x=${WIDTH + 4} y=${HEIGHT / 2 + 3}>0</text><text x=${WIDTH + 4} y=${HEIGHT - 2}>−${number(top, digits)}</text>
      ${groups.map(({ border, bars }) => { x += GAP; return bars.map(({ index, px, stray }) => {
        const at = x; x += step;
        const isPicked = picked.value.some((p) => p.feature === border && p.index === index);
        return html`<g key=${`${border}:${index}`} class=${`${isPicked ? "picked" : ""}${stray ? " stray" : ""}`} style=${`--colour:${colour(border)}`} onClick=${() => select([{ feature: border, index }])}>
          <rect class="hit" x=${at} y="0" width=${step} height=${HEIGHT}/><rect class="stick" x=${at + step * 0.2} width=${step * 0.6} y=${Math.min(y(px), HEIGHT / 2)} height=${Math.max(1, Math.abs(y(px) - HEIGHT / 2))}/>
          <title>${border} point ${index + 1}: ${number(px, 2)} px${stray ? ", a stray" : ""}</title></g>`;
      }); })}
    </svg>
    <div class="line"><${ActionButton} id="arrows" label=${arrows.value.on ? "Hide the arrows" : "Show as arrows on the picture"}/></div></section>`;
}

/** Along the border, as the eye goes. @param {import("../types").Border} border @param {import("../types").Curve} curve */
function inOrder(border, curve) {
  const run = border === "left" || border === "right" ? 1 : 0, strays = new Set(curve.outliers);
  return curve.residuals_px.map((px, index) => ({ px, index, stray: strays.has(index), at: curve.points[index][run] })).toSorted((a, b) => a.at - b.at);
}

/** A scale's end that reads well: 0.5, 1, 2, 5, 10 … @param {number} value */
function roundUp(value) {
  const ten = 10 ** Math.floor(Math.log10(Math.max(value, 0.05)));
  return [1, 2, 5, 10].map((f) => f * ten).find((v) => v >= value) ?? 10 * ten;
}
