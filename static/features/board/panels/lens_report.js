// What a lens from a board is worth: how far off it may be, what to doubt, where corners were, the next view that
// helps.
import { number, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { Title } from "../../../ui/title.js";
import { foundLens } from "../board.js";

const LEVEL = { good: "Good", fair: "Fair", poor: "Poor" };
const OF_VIEWS = new Set(["no-board", "view-left-out"]); // these stand at their pictures

/** A length of any size with three digits. @param {number | null} value */
const px = (value) =>
  value === null ? "–" : number(value, Math.abs(value) < 0.1 ? 3 : Math.abs(value) < 10 ? 2 : 0);

export function LensReport() {
  const lens = foundLens.value;
  if (!lens)
    return html`<section>
      <${Title} of="lens">Good views<//>
      <ul class="plain">
        <li>
          <b>Tilted</b> about 35° to each of its four sides: views that face the camera tell little.
        </li>
        <li>
          <b>All over</b> the picture, into its corners.
        </li>
        <li>
          <b>Large</b>: a third of the picture's width, or all of it.
        </li>
        <li>
          <b>Still and sharp</b>; focus and zoom as in the game.
        </li>
        <li>
          <b>Stiff</b>: the board on a plate.
        </li>
      </ul>
    </section>`;
  const it = lens.report,
    next = it.next_view,
    doubts = it.warnings.filter((w) => !OF_VIEWS.has(w.reason)),
    left = it.warnings.filter((w) => OF_VIEWS.has(w.reason));
  return html`
    <section aria-label="Lens">
      <h2>${lens.note || "Lens"}</h2>
      <div class="verdict" data-testid="lens-verdict" data-level=${it.verdict.level}>
        <div class="big">
          ${px(it.expected_px.median)}
          <small> px expected error</small>
        </div>
        <p>
          <b class=${`level ${it.verdict.level}`}>${LEVEL[it.verdict.level]}.</b> ${it.verdict.sentence}
        </p>
        <dl>
          <div>
            <dd data-testid="lens-rms">${px(it.rms_px)} px</dd>
            <dt>rms</dt>
          </div>
          <div>
            <dd>${px(it.sigma_px)} px</dd>
            <dt>σ of a corner</dt>
          </div>
          <div>
            <dd>${px(it.expected_px.max)} px</dd>
            <dt>worst place</dt>
          </div>
        </dl>
      </div>
      ${lens.id && html`<p>
        <a href=${addressOf("scene", { scene: `lens/${lens.id}` })} data-testid="lens-scene">
          Show how the board was held, in 3-D
        </a>
      </p>`}
      ${next && html`<p class="plainly" data-testid="next-view">
        <b>Next view.</b> ${next.text} It lowers the worst place from ${px(next.worst_before_px)} to${" "}
        ${px(next.worst_after_px)} px.
      </p>`}
      <ul class="warnings" data-testid="lens-warnings">
        ${doubts.map((w) => html`<li key=${w.reason + w.text} data-reason=${w.reason}>
          <b>${w.text}</b> ${w.fix}
        </li>`)}
      </ul>
      ${left.length > 0 && 
        html`<p class="reason">${plural(left.length, "picture")} left out; beside each stands why.</p>`}
    </section>
    <${Coverage} report=${it} />
    <section aria-label="Checks">
      <${Title} of="lens">Checks<//>
      <dl class="details">
        ${rows(it).map(([what, value]) => html`<div key=${what}>
          <dt>${what}</dt>
          <dd>${value}</dd>
        </div>`)}
      </dl>
    </section>
    <section aria-label="Parameters">
      <h2>Parameters</h2>
      <dl class="details" data-testid="lens-parameters">
        ${Object.entries(it.parameters).map(([name, { value, sigma }]) => html`<div key=${name}>
          <dt>${name}</dt>
          <dd>
            ${plain(value)}
            ${sigma ? ` ± ${plain(sigma, 2)}` : ", held"}
          </dd>
        </div>`)}
      </dl>
    </section>
  `;
}

/** @param {import("../../../core/types").LensRecord["report"]} it @returns {[string, string][]} */
const rows = (it) => [
  ["Corners", `${it.corners}, ${it.strays} left out`],
  ["Held-out views", times(it.cross_validation.held_out_px, it.cross_validation.held_out_ratio)],
  ["Halves of the views", times(it.cross_validation.halves_px, it.cross_validation.halves_ratio)],
  ["Neighbours err alike", number(it.neighbour_correlation, 2)],
  ...(it.bow_mm
    ? [
        /** @type {[string, string]} */ ([
          "Bow of the board",
          `${number(it.bow_mm.x, 1)}, ${number(it.bow_mm.y, 1)} mm`,
        ]),
      ]
    : []),
];

/** @param {number | null} value @param {number | null} ratio */
const times = (value, ratio) => (value === null ? "–" : `${px(value)} px, ${number(ratio, 1)} σ`);

/** @param {number} value @param {number} [digits] */
const plain = (value, digits = 5) =>
  (Math.abs(value) >= 1e5 ? value.toExponential(3) : String(Number(value.toPrecision(digits)))).replace(
    "-",
    "−",
  );

/**
 * Where in the picture corners were seen, and how the board was tilted.
 * @param {{ report: import("../../../core/types").LensRecord["report"] }} props
 */
function Coverage({ report: { coverage } }) {
  const { cells, share, tilts } = coverage,
    columns = cells[0].length,
    most = Math.max(...cells.flat(), 1);
  return html`<section aria-label="Coverage">
    <h2>Coverage, ${number(100 * share, 0)} % of the picture</h2>
    <svg
      class="coverage"
      viewBox=${`0 0 ${columns} ${cells.length}`}
      role="img"
      aria-label=${`Corners in ${number(100 * share, 0)} % of the picture's ${columns * cells.length} cells`}
    >
      ${cells.flatMap((row, y) =>
        row.map((count, x) => html`<rect
          key=${`${x},${y}`}
          x=${x + 0.04}
          y=${y + 0.04}
          width=".92"
          height=".92"
          rx=".08"
          class=${count ? "" : "none"}
          style=${`opacity:${count ? 0.25 + 0.75 * Math.sqrt(count / most) : 1}`}
        >
          <title>${plural(count, "corner")}</title>
        </rect>`),
      )}
    </svg>
    <dl class="details">
      ${Object.entries(tilts).map(([how, count]) => html`<div key=${how}>
        <dt>${how[0].toUpperCase() + how.slice(1)}</dt>
        <dd>${plural(count, "view")}</dd>
      </div>`)}
    </dl>
  </section>`;
}
