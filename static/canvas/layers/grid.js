// Draws the grid of field millimetres over a picture.
import { html } from "../../core/html.js";
import { path, placed } from "../drawing.js";
import { gridLines } from "../../features/compare/grid.js";

/**
 * on: which picture; size: of it, which clips it; x, y, k: where it lies.
 * @param {{ on: "raw" | "corrected", size: import("../../core/types").Point, x: number, y: number, k: number }} props
 */
export function Grid({ on, size: [width, height], x, y, k }) {
  const it = gridLines.value;
  if (!it) return null;
  return html`<g
    class="grid"
    data-testid=${`grid-${on}`}
    data-of=${it.of}
    transform=${placed(x, y, k)}
    clip-path=${`url(#grid-${on})`}
  >
    <clipPath id=${`grid-${on}`}>
      <rect x="-.5" y="-.5" width=${width} height=${height} />
    </clipPath>
    ${it[on].map((line) => html`<path key=${line.feature} class="casing" d=${path(line.points)} />`)}
    ${it[on].map(
      (line) =>
        html`<path key=${line.feature} class=${line.kind} data-line=${line.feature} d=${path(line.points)} />`,
    )}
  </g>`;
}
