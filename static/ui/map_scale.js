// The one scale of every map of millimetres: 5 is where good ends and 15 where usable does, so that a colour means the
// same on each map.
import { html } from "../core/html.js";
import { t } from "../core/words.js";

/** Even steps of lightness, told apart by colour-blind eyes and in grey (viridis). */
export const STOPS = [
  "#440154",
  "#482878",
  "#3e4a89",
  "#31688e",
  "#26828e",
  "#1f9e89",
  "#35b779",
  "#6ece58",
  "#b5de2b",
  "#fde725",
];
const GOOD_MM = 5;
/** The end of the scale; more has the colour of this. */
export const TOP_MM = 15;

/** The colour of a length, for what is drawn in steps. @param {number} mm */
export const shadeOf = (mm) => STOPS[Math.round(Math.min(1, mm / TOP_MM) * (STOPS.length - 1))];

export const MapScale = () => html`<div
  class="scale"
  role="img"
  aria-label=${t("common.colour-scale", { good: GOOD_MM, worst: TOP_MM })}
>
  <i style=${`background:linear-gradient(to right, ${STOPS.join()})`}></i>
  <div style="position:relative">
    <span>0</span>
    <span style=${`position:absolute;left:${(100 * GOOD_MM) / TOP_MM}%;transform:translateX(-50%)`}>${GOOD_MM}</span>
    <span>${TOP_MM} mm</span>
  </div>
</div>`;
