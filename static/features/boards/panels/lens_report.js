// What a lens from a board is worth: how far off it may be, what to doubt, where corners were, the next view that
// helps.
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { Title } from "../../../ui/title.js";
import { foundLens } from "../board.js";

const LEVEL = {
  good: t("common.level.good"),
  fair: t("common.level.fair"),
  poor: t("common.level.poor"),
};
const OF_VIEWS = new Set(["no-board", "view-left-out"]); // these stand at their pictures

/** A length of any size with three digits. @param {number | null} value */
const px = (value) =>
  value === null ? "–" : number(value, Math.abs(value) < 0.1 ? 3 : Math.abs(value) < 10 ? 2 : 0);

export function LensReport() {
  const lens = foundLens.value;
  if (!lens)
    return html`<section>
      <${Title} of="lens">${t("board.good-views.title")}<//>
      <ul class="plain">
        <li>${rich("board.good-views.tilted")}</li>
        <li>${rich("board.good-views.all-over")}</li>
        <li>${rich("board.good-views.large")}</li>
        <li>${rich("board.good-views.still")}</li>
        <li>${rich("board.good-views.stiff")}</li>
      </ul>
    </section>`;
  const it = lens.report,
    next = it.next_view,
    doubts = it.warnings.filter((w) => !OF_VIEWS.has(w.reason)),
    left = it.warnings.filter((w) => OF_VIEWS.has(w.reason));
  return html`
    <section aria-label=${t("lens-pictures.lens")}>
      <h2>${lens.note || t("lens-pictures.lens")}</h2>
      <div class="verdict" data-testid="lens-verdict" data-level=${it.verdict.level}>
        <div class="big">
          ${px(it.expected_px.median)}
          <small>${` ${t("board.report.expected-error")}`}</small>
        </div>
        <p>
          <b class=${`level ${it.verdict.level}`}>${LEVEL[it.verdict.level]}.</b> ${it.verdict.sentence}
        </p>
        <dl>
          <div>
            <dd data-testid="lens-rms">${px(it.rms_px)} px</dd>
            <dt>${t("board.report.rms")}</dt>
          </div>
          <div>
            <dd>${px(it.sigma_px)} px</dd>
            <dt>${t("board.report.corner-sigma")}</dt>
          </div>
          <div>
            <dd>${px(it.expected_px.max)} px</dd>
            <dt>${t("board.report.worst-place")}</dt>
          </div>
        </dl>
      </div>
      ${
        lens.id &&
        html`<p>
        <a href=${addressOf("scene", { scene: `lens/${lens.id}` })} data-testid="lens-scene">
          ${t("board.report.show-scene")}
        </a>
      </p>`
      }
      ${
        next &&
        html`<p class="plainly" data-testid="next-view">
        ${rich("board.report.next-view", {
          text: next.text,
          before: px(next.worst_before_px),
          after: px(next.worst_after_px),
        })}
      </p>`
      }
      <ul class="warnings" data-testid="lens-warnings">
        ${doubts.map(
          (w) => html`<li key=${w.reason + w.text} data-reason=${w.reason}>
          <b>${w.text}</b> ${w.fix}
        </li>`,
        )}
      </ul>
      ${
        left.length > 0 &&
        html`<p class="reason">${t("board.report.left-out", { count: left.length })}</p>`
      }
    </section>
    <${Coverage} report=${it} />
    <section aria-label=${t("board.report.checks")}>
      <${Title} of="lens">${t("board.report.checks")}<//>
      <dl class="details">
        ${rows(it).map(
          ([what, value]) => html`<div key=${what}>
          <dt>${what}</dt>
          <dd>${value}</dd>
        </div>`,
        )}
      </dl>
    </section>
    <section aria-label=${t("board.report.parameters")}>
      <h2>${t("board.report.parameters")}</h2>
      <dl class="details" data-testid="lens-parameters">
        ${Object.entries(it.parameters).map(
          ([name, { value, sigma }]) => html`<div key=${name}>
          <dt>${name}</dt>
          <dd>
            ${plain(value)}
            ${sigma ? ` ± ${plain(sigma, 2)}` : `, ${t("board.report.held")}`}
          </dd>
        </div>`,
        )}
      </dl>
    </section>
  `;
}

/** @param {import("../../../core/types").LensRecord["report"]} it @returns {[string, string][]} */
const rows = (it) => [
  [
    t("common.corners"),
    t("board.report.corner-counts", { corners: it.corners, outliers: it.strays }),
  ],
  [
    t("board.report.held-out-views"),
    times(it.cross_validation.held_out_px, it.cross_validation.held_out_ratio),
  ],
  [
    t("board.report.halves-of-views"),
    times(it.cross_validation.halves_px, it.cross_validation.halves_ratio),
  ],
  ...(it.focal_drift && it.focal_drift.pct !== null
    ? [
        /** @type {[string, string]} */ ([
          t("board.report.focal-drift"),
          `${number(it.focal_drift.pct, 2)} ± ${number(it.focal_drift.sigma_pct, 2)} %`,
        ]),
      ]
    : []),
  [t("board.report.neighbours"), number(it.neighbour_correlation, 2)],
  ...(it.bow_mm
    ? [
        /** @type {[string, string]} */ ([
          t("board.report.bow"),
          `${number(it.bow_mm.x, 1)}, ${number(it.bow_mm.y, 1)} mm`,
        ]),
      ]
    : []),
];

/** @param {number | null} value @param {number | null} ratio */
const times = (value, ratio) => (value === null ? "–" : `${px(value)} px, ${number(ratio, 1)} σ`);

/** @param {number} value @param {number} [digits] */
const plain = (value, digits = 5) =>
  (Math.abs(value) >= 1e5
    ? value.toExponential(3)
    : String(Number(value.toPrecision(digits)))
  ).replace("-", "−");

/**
 * Where in the picture corners were seen, and how the board was tilted.
 * @param {{ report: import("../../../core/types").LensRecord["report"] }} props
 */
function Coverage({ report: { coverage } }) {
  const { cells, share, tilts } = coverage,
    columns = cells[0].length,
    most = Math.max(...cells.flat(), 1);
  return html`<section aria-label=${t("board.coverage.title")}>
    <h2>${t("board.coverage.share", { share: number(100 * share, 0) })}</h2>
    <svg
      class="coverage"
      viewBox=${`0 0 ${columns} ${cells.length}`}
      role="img"
      aria-label=${t("board.coverage.corners-in-cells", {
        share: number(100 * share, 0),
        cells: columns * cells.length,
      })}
    >
      ${cells.flatMap((row, y) =>
        row.map(
          (count, x) => html`<rect
          key=${`${x},${y}`}
          x=${x + 0.04}
          y=${y + 0.04}
          width=".92"
          height=".92"
          rx=".08"
          class=${count ? "" : "none"}
          style=${`opacity:${count ? 0.25 + 0.75 * Math.sqrt(count / most) : 1}`}
        >
          <title>${t("board.coverage.corners", { count })}</title>
        </rect>`,
        ),
      )}
    </svg>
    <dl class="details">
      ${Object.entries(tilts).map(
        ([how, count]) => html`<div key=${how}>
        <dt>${how[0].toUpperCase() + how.slice(1)}</dt>
        <dd>${t("common.views", { count })}</dd>
      </div>`,
      )}
    </dl>
  </section>`;
}
