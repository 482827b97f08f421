// Drawn under the points: lines that the fit predicts and nobody has clicked, and proposed points.
import { computed } from "@preact/signals";
import { doc, pointsOf } from "../../core/document.js";
import { lineTitle } from "../../core/format.js";
import { html } from "../../core/html.js";
import { active, pointer, showLines, snapshot } from "../../core/state.js";
import { colour, path, placed } from "../drawing.js";
import { toStage, view } from "../viewport.js";
import {
  lineUnderPointer,
  offered,
  suggestedLines,
} from "../../features/calibrate/line_suggestions.js";

const paths = computed(() =>
  suggestedLines.value.map((f) => ({
    feature: f.feature,
    d: path(f.points),
    clicked: pointsOf(doc.value, f.feature).length > 0,
  })),
);

export function LineSuggestions() {
  const { k, tx, ty } = view.value,
    over = lineUnderPointer.value,
    size = snapshot.value;
  if (!size) return null;
  const drawn = showLines.value ? [] : paths.value.filter((f) => !f.clicked || f.feature === over);
  return html`
    <g class="ghost" data-testid="ghost" transform=${placed(tx, ty, k)} clip-path="url(#ghost-in)">
      <clipPath id="ghost-in">
        <rect x="-.5" y="-.5" width=${size.width} height=${size.height} />
      </clipPath>
      ${drawn.map(
        ({ feature, d }) => html`<path
        key=${feature}
        data-ghost=${feature}
        d=${d}
        style=${`--colour:${colour(feature)}`}
        class=${feature === over ? "over" : feature === active.value ? "active" : ""}
      />`,
      )}
    </g>
    <${Proposals} />
    <${Over} />
  `;
}

function Proposals() {
  void view.value;
  return offered.value.map(
    ({ feature, points }) => html`<g
    key=${feature}
    class="proposals"
    style=${`--colour:${colour(feature)}`}
  >
    ${points.map((p, i) => {
      const [x, y] = toStage(...p);
      return html`<path
        key=${i}
        data-proposed=${i}
        transform=${`translate(${x} ${y})`}
        d="M0 -6.5L6.5 0L0 6.5L-6.5 0Z"
      />`;
    })}
  </g>`,
  );
}

/** Which line a click would go to. */
function Over() {
  const at = pointer.value,
    over = lineUnderPointer.value;
  if (!at || !over) return null;
  const [x, y] = toStage(at.x, at.y);
  return html`<text class="over" data-testid="ghost-over" x=${x + 14} y=${y - 12}>
    ${lineTitle(over)}
  </text>`;
}
