// Rings the clicks that are pointed at in a plot, on the raw picture.
import { html } from "../../core/html.js";
import { toStage, view } from "../viewport.js";
import { groups, hovered, isSame } from "../../features/calibrate/residuals.js";

export function Hovered() {
  const picks = hovered.value;
  if (!picks.length) return null;
  void view.value;
  const bars = groups.value
    .flatMap((g) => g.bars)
    .filter((bar) => picks.some((p) => isSame(p, bar)));
  return html`<svg class="overlay hovered" data-testid="hovered" aria-hidden="true">
    ${bars.map(({ feature, index, point }) => {
      const [x, y] = toStage(...point);
      return html`<circle key=${`${feature}:${index}`} data-of=${`${feature}:${index}`} cx=${x} cy=${y} r="12" />`;
    })}
  </svg>`;
}
