// How positions change against the active version: arrows over the covered area, magnified.
import { mm, number, roundDown } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { version } from "../../versions/versions.js";
import { arcPoints, rectOf, turned } from "../../calibrate/field_sides.js";
import { arrowPath } from "../../../canvas/arrows.js";
import { change } from "../checks.js";

/** @typedef {import("../../../core/types").Point} Point */

const EVERY = 4; // of the server's 25 × 19 places: as many arrows as can be told apart
const SIZE = 360; // of the drawing for its arrowheads, screen pixels
const REACH = 0.8; // of the distance between two arrows: so long is the longest

export function ChangeMap() {
  const it = version.value,
    now = change.value,
    grid = now?.difference.grid;
  const r = it?.field_definition.regions[it.region];
  if (!it || !now || !grid || !r) return null;
  const { lines, arcs } = it.field_definition,
    rect = rectOf(r, it.rotate),
    unit = Math.max(rect.width, rect.height) / 200, // one screen pixel, about
    at = (/** @type {Point} */ p) => turned(p, it.rotate);
  const arrows = sampled(grid),
    longest = Math.max(0, ...arrows.map(({ by }) => Math.hypot(...by))),
    apart = (EVERY * Math.hypot(r.x[1] - r.x[0], r.y[1] - r.y[0])) / Math.hypot(24, 18),
    times = longest > 0 ? roundDown((REACH * apart) / longest) : 1; // without a change nothing is drawn longer
  const { median_mm, max_mm, worst_place } = now.difference,
    figures = { median: mm(median_mm), worst: mm(max_mm) };
  return html`<section aria-label=${t("verify.change", { former: now.from })} data-testid="change-map">
    <h2>${t("verify.change", { former: now.from })}</h2>
    <figure class="change">
      <svg
        viewBox=${`${rect.x - 8 * unit} ${rect.y - 8 * unit} ${rect.width + 16 * unit} ${rect.height + 16 * unit}`}
        role="img"
        aria-label=${
          worst_place
            ? t("verify.change.figures-at", {
                ...figures,
                place: worst_place.map((v) => number(v, 0)).join(", "),
              })
            : t("verify.change.figures", figures)
        }
      >
        <clipPath id="change-area"><rect ...${rect} /></clipPath>
        <rect class="carpet" ...${rect} />
        <g class="paint" clip-path="url(#change-area)">
          ${lines.map((l) => html`<path key=${l.name} d=${`M${at(l.from).join()}L${at(l.to).join()}`} />`)}
          ${arcs.map(
            (a) =>
              html`<path key=${a.name} d=${`M${arcPoints(a)
                .map((p) => at(p).join())
                .join("L")}`} />`,
          )}
        </g>
        ${arrows.map(
          ({ place, by }, i) =>
            html`<path key=${i} class="arrow" d=${arrowPath(shifted(at(place), at(by)), times, SIZE * unit)} />`,
        )}
      </svg>
      <figcaption class="reason">
        ${t("verify.change.caption", { ...figures, times: number(times, times < 1 ? 2 : 0) })}
      </figcaption>
    </figure>
  </section>`;
}

/** @param {Point} was @param {Point} by */
const shifted = (was, by) => ({
  was,
  now: /** @type {Point} */ ([was[0] + by[0], was[1] + by[1]]),
});

/** A few of the places, and how far each moves, mm. @param {NonNullable<import("../types").Difference["grid"]>} grid */
const sampled = ({ places, mm_vector }) =>
  places.flatMap((row, j) =>
    row.flatMap((place, i) => {
      const [x, y] = mm_vector[j][i] ?? [null, null];
      const isShown = i % EVERY === 2 && j % EVERY === 1 && x !== null && y !== null;
      return isShown ? [{ place, by: /** @type {Point} */ ([x, y]) }] : [];
    }),
  );
