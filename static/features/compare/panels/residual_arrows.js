// The legend of the residual arrows: their magnification, a ruler, and the longest of them.
import { run } from "../../../core/actions.js";
import { lineName, mm, number, roundDown } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { comparing } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { view } from "../../../canvas/viewport.js";
import { correctedPlacement, visiblePicture } from "../comparison.js";
import {
  FACTORS,
  arrows,
  factor,
  longest,
  longestOf,
  magnify,
  shownArrows,
} from "../residual_arrows.js";

const RULER_PX = 100; // on the stage, at most

/** On the stage, while arrows are shown. */
export function ArrowLegend() {
  const all = shownArrows.value?.image.arrows;
  if (!all) return null;
  const times = factor.value,
    cut = all.filter((a) => (a.px ?? 0) * times > longest.value).length,
    unseen = all.filter((a) => a.px === null).length;
  const far = longestOf(all, false),
    stray = longestOf(all, true),
    strays = all.filter((a) => a.outlier).length;
  return html`<section
    class="legend narrow"
    data-testid="arrow-legend"
    aria-label=${t("compare.arrows.legend")}
  >
    <h2>${t("compare.arrows.heading", { factor: times })}</h2>
    <${Ruler} />
    <label class="magnify">
      <span class="sr">${t("compare.arrows.magnification")}</span>
      <input
        type="range"
        data-testid="magnification"
        min="0"
        max=${FACTORS.length - 1}
        step="1"
        value=${FACTORS.indexOf(times)}
        aria-valuetext=${t("compare.arrows.times", { factor: times })}
        onInput=${(/** @type {any} */ e) => magnify(FACTORS[Number(e.target.value)])}
      />
    </label>
    <div class="switch">
      <button
        type="button"
        data-testid="magnify-auto"
        aria-pressed=${arrows.value.factor === null}
        onClick=${() => run("arrows-auto")}
      >
        ${t("compare.auto")}
      </button>
    </div>
    <p data-testid="arrow-figures">
      ${
        far &&
        html`
        ${rich("compare.arrows.longest", { px: number(far.px, 2), mm: mm(far.mm), point: nameOf(far) })}${" "}
      `
      }
      ${
        stray &&
        html`
        ${rich("compare.arrows.strays", {
          count: strays,
          strays: html`<b class="level fair">${t("common.strays", { count: strays })}</b>`,
          px: number(stray.px, 1),
        })}${" "}
      `
      }
      ${cut > 0 && `${t("compare.arrows.cut-short", { count: cut })} `}
      ${unseen > 0 && t("compare.arrows.out-of-reach", { count: unseen })}
    </p>
  </section>`;
}

/** A length on the stage with what it means at the clicks. */
function Ruler() {
  const onCorrected = comparing.value && visiblePicture.value === "corrected",
    of = shownArrows.value?.[onCorrected ? "corrected" : "image"];
  const unit =
      factor.value * view.value.k * (onCorrected ? (correctedPlacement.value?.scale ?? 1) : 1),
    px = roundDown(RULER_PX / unit),
    each = of?.mm_per_px;
  const length = onCorrected
      ? t("compare.arrows.corrected-px", { length: plain(px) })
      : `${plain(px)} px`,
    label = `${length}${each ? ` ≈ ${plain(px * each, 1)} mm` : ""}`;
  return html`<div
    class="ruler"
    role="img"
    aria-label=${t("compare.arrows.ruler", { length: label })}
    data-testid="ruler"
    data-px=${px}
  >
    <i style=${`width:${px * unit}px`}></i>
    <span>${label}</span>
  </div>`;
}

/** @param {number} value @param {number} [more] digits after the first */
const plain = (value, more = 0) => number(value, Math.max(0, more - Math.floor(Math.log10(value))));

/** @param {import("../../../core/types").Arrow} arrow */
const nameOf = ({ feature, index }) =>
  typeof feature === "string"
    ? t("compare.arrows.point-of-feature", { feature: lineName(feature), number: index + 1 })
    : t("compare.arrows.point-of-spot", {
        place: feature.map((v) => number(v, 0)).join(", "),
        number: index + 1,
      });
