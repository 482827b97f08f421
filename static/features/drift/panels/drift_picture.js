// The camera's picture with the lines as the calibration expects them, and arrows to where they have moved.
import { mm } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { LevelLegend } from "./level_legend.js";
import { VIEW_PX, statuses } from "../../live/camera_status.js";
import { LiveView } from "../../live/layers/live_view.js";
import { arrowPath, drawnPlaces } from "../../../canvas/arrows.js";
import { displacement, longestArrow } from "../displacement.js";

/** @param {{ id: string, name: string }} props */
export function DriftPicture({ id, name }) {
  const it = displacement.value,
    size = it?.image_size ?? null,
    { width, height } = statuses.value[id] ?? {};
  const { times, mm: longest } = longestArrow.value;
  const [w, h] = size ?? [width || 5, height || 4];
  return html`<figure class="drift-picture" aria-label=${t("drift.picture")} data-testid="drift-picture">
    <div class="over" style=${`--ratio:${w / h}`}>
      <${LiveView} id=${id} name=${name} width=${VIEW_PX} lines=${true} />
      ${size && html`<${Arrows} places=${it?.places ?? []} width=${w} height=${h} />`}
    </div>
    <figcaption data-testid="drift-legend">
      ${
        it?.places.length
          ? html`<p>
            <b>${t("drift.arrows.scale", { times, longest: mm(longest) })}</b>${" "}
            ${t("drift.arrows.what")}
          </p>
          <${LevelLegend} />`
          : html`<p class="reason">${t(it ? "drift.arrows.none" : "drift.asking")}</p>`
      }
    </figcaption>
  </figure>`;
}

/** @param {{ places: import("../../../core/types").Displacement["places"], width: number, height: number }} props */
const Arrows = ({ places, width, height }) => {
  const { times } = longestArrow.value,
    diagonal = Math.hypot(width, height),
    drawn = drawnPlaces(places, diagonal),
    paths = drawn.map((place) => arrowPath(place, times, diagonal));
  return html`<svg
    class="drift-arrows"
    viewBox=${`-0.5 -0.5 ${width} ${height}`}
    aria-hidden="true"
    data-testid="drift-arrows"
    data-count=${places.length}
    data-times=${times}
  >
    ${paths.map((d, i) => html`<path key=${i} class="casing" d=${d} />`)}
    ${drawn.map(({ level }, i) => html`<path key=${i} data-level=${level} d=${paths[i]} />`)}
  </svg>`;
};
