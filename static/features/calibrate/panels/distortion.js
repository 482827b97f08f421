// How bent each border is, against the ± 3 % of a standard lens, before and after correction.
import { BORDERS } from "../../../core/document.js";
import { capitalised, lineTitle, pct } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { Fold } from "../../../ui/fold.js";
import { colour } from "../../../canvas/drawing.js";
import { curves, isCurve, preview, stale } from "../fitting.js";

const STANDARD_PCT = 3; // Eq. (9): a standard lens is within ± 3 %
/** @type {Record<string, string>} */
const KINDS = {
  barrel: t("calibrate.distortion.kind.barrel"),
  none: t("calibrate.distortion.kind.none"),
  pincushion: t("calibrate.distortion.kind.pincushion"),
};

/** @param {{ report?: import("../../../core/types").Report }} props a saved version's report, else the present one */
export function Distortion({ report }) {
  const it = report ?? preview.value?.report,
    isNow = !report;
  const rows = BORDERS.map((border) => {
    const curve = curves.value[border],
      reported = it?.distortion.per_border[border];
    return {
      border,
      // one definition: a curve's own bend, over its points alone, stands only where there is no fit yet
      before:
        reported?.before_pct ?? (isNow && !it && isCurve(curve) ? curve.distortion_pct : null),
      after: isNow && stale.value ? null : (reported?.after_pct ?? null),
    };
  });
  const all = it?.distortion,
    full = Math.max(1.5 * STANDARD_PCT, ...rows.map(({ before }) => 1.1 * Math.abs(before ?? 0))),
    at = (/** @type {number} */ v) => 50 + (50 * v) / full;
  const value = !all
    ? ""
    : all.kind === null
      ? "–"
      : `${pct(all.before_pct)} %, ${KINDS[all.kind]}`;
  return html`<section aria-label=${t("common.distortion")}>
    <${Fold} id="distortion" title=${t("common.distortion")} value=${value}>
    ${rows.map(
      ({ border, before, after }) => html`<div
      key=${border}
      class="bar-row"
      data-testid=${`distortion-${border}`}
      title=${after === null ? "" : t("calibrate.distortion.after", { after: pct(after) })}
    >
      <i class="chip" style=${`--colour:${colour(border)}`}>
        ${lineTitle(border)[0]}
      </i>
      <span>${lineTitle(border)}</span>
      <div class="bar" aria-hidden="true">
        <i class="band" style=${`left:${at(-STANDARD_PCT)}%;right:${100 - at(STANDARD_PCT)}%`}></i>
        <s class="zero"></s>
        ${
          before !== null &&
          html`<b
          class=${Math.abs(before) > STANDARD_PCT ? "over" : ""}
          style=${`left:${Math.min(50, at(before))}%;width:${Math.abs(at(before) - 50)}%`}
        ></b>`
        }
        ${
          after !== null &&
          html`<s class="after" style=${`left:${at(Math.max(-full, Math.min(full, after)))}%`}></s>`
        }
      </div>
      <em>${before === null ? "–" : `${pct(before)} %`}</em>
    </div>`,
    )}
    <p class="key">
      <span>
        <i class="band"></i>${t("calibrate.distortion.key.standard", { limit: STANDARD_PCT })}
      </span>
      <span>
        <i class="after"></i>${t("calibrate.distortion.key.after")}
      </span>
    </p>
    ${
      all &&
      html`<p class="reason" data-testid="distortion">
      ${found(all)}
    </p>`
    }
    <//>
  </section>`;
}

/** Which distortion was found; where one is unknown, what would make it known.
 * @param {import("../../../core/types").Report["distortion"]} all */
function found({ kind, before_pct, after_pct }) {
  if (kind === null) return t("calibrate.distortion.unknown");
  const values = { kind: capitalised(KINDS[kind]), before: pct(before_pct) };
  return after_pct === null
    ? t("calibrate.distortion.after-unknown", values)
    : t("calibrate.distortion.found", { ...values, after: pct(after_pct) });
}
