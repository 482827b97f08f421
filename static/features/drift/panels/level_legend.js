// What the arrows' colours mean.
import { FAIR_MM, GOOD_MM } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";

export const LevelLegend = () => html`<ul class="drift-levels">
  <li data-level="good"><i></i> ${t("drift.level.good", { limit: GOOD_MM })}</li>
  <li data-level="fair"><i></i> ${t("drift.level.fair", { limit: FAIR_MM })}</li>
  <li data-level="poor"><i></i> ${t("drift.level.poor", { limit: FAIR_MM })}</li>
</ul>`;
