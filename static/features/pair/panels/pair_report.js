// Right of two pictures: whether the cameras agree, how far matches are from their lines, how the cameras stand to each
// other.
import { mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { fields } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { shadeOf } from "../../../ui/map_scale.js";
import { Title } from "../../../ui/title.js";
import { chosenBasis, linesBases, linesBasis, pairAnswer, refusal, stale } from "../evaluation.js";
import { choose, removeMatch } from "../matches.js";
import { both, calibrations } from "../pair.js";

/** @typedef {import("../types").PairAnswer} PairAnswer @typedef {import("../types").Verdict} Sentence */

const LEVEL = { good: t("common.level.good"), fair: t("common.level.fair"), poor: t("common.level.poor") };
const PART = {
  fundamental: t("pair.part.fundamental"),
  pose: t("pair.part.pose"),
  calibrated: t("pair.part.calibrated"),
  agreement: t("pair.part.agreement"),
};
const SHOWN = 6; // mistakes with buttons of their own

export function PairReport() {
  const it = pairAnswer.value,
    why = refusal.value;
  if (why)
    return html`<section aria-label=${t("pair.result")}>
      <h2>${t("pair.result.title")}</h2>
      <div class="warning-line" role="alert" data-testid="pair-refusal">
        <b>${why.detail}</b> ${why.fix}
      </div>
    </section>`;
  if (!it) return html`<${Advice} />`;
  return html`<div
    class=${stale.value ? "pair-report stale" : "pair-report"}
    data-testid="pair-report"
    data-stale=${stale.value}
  >
    ${it.agreement && html`<${Agreement} it=${it.agreement} />`}
    ${(it.fundamental || it.calibrated) && html`<${Epipolar} it=${it} />`}
    ${(it.pose || it.calibrated) && html`<${Pose} it=${it} />`}
    ${it.failed.length > 0 && html`<section aria-label=${t("pair.not-known")}>
      <h2>${t("pair.not-known")}</h2>
      <ul class="warnings" data-testid="pair-failed">
        ${reasons(it).map(({ part, what, fix }) => html`<li key=${part} data-part=${part}>
          <b>
            ${PART[part]}: ${what}
          </b>${" "}
          ${fix}
        </li>`)}
      </ul>
    </section>`}
  </div>`;
}

/** Each reason once: what the geometry lacks, the pose lacks too. @param {PairAnswer} it */
const reasons = (it) => it.failed.filter((f, i) => it.failed.findIndex((g) => g.what === f.what) === i);

/** @param {{ v: Sentence }} props */
const Words = ({ v }) => html`
  <p>
    <b class=${`level ${v.level}`}>${LEVEL[v.level]}.</b> ${v.sentence}
  </p>
  ${v.fix && html`<p class="fix">${v.fix}</p>`}
`;

/** @param {{ it: NonNullable<PairAnswer["agreement"]> }} props */
function Agreement({ it }) {
  const [x, y] = it.where;
  return html`<section aria-label=${t("pair.part.agreement")}>
    <${Title} of="agreement">${t("pair.agreement.title")}<//>
    <div class="verdict" data-testid="agreement" data-level=${it.verdict.level}>
      <div class="big">
        ${mm(it.median_mm)}
        <small>${` ${t("pair.agreement.median")}`}</small>
      </div>
      <${Words} v=${it.verdict} />
      <dl>
        <div>
          <dd data-testid="agreement-worst">${mm(it.max_mm)} mm</dd>
          <dt>${t("pair.agreement.worst")}</dt>
        </div>
        <div>
          <dd>
            ${number(x, 0)}, ${number(y, 0)} mm
          </dd>
          <dt>${t("pair.agreement.where")}</dt>
        </div>
        <div>
          <dd>${it.n}</dd>
          <dt>${it.from === "matches" ? t("pair.agreement.matches") : t("pair.agreement.places")}</dt>
        </div>
      </dl>
    </div>
    <${Map} it=${it} />
    <p class="reason">
      ${t("pair.agreement.overlap", { area: number(it.overlap_m2, 1), share: number(100 * it.covered, 0) })}${" "}
      ${it.from === "clicks" ? t("pair.agreement.from-clicks") : ""}
    </p>
  </section>`;
}

/** Where on the field, in colours from 0 to the worst. @param {{ it: NonNullable<PairAnswer["agreement"]> }} props */
function Map({ it }) {
  const field = fields.value.find((f) => f.name === (calibrations.value.a ?? calibrations.value.b)?.field),
    { x, y, mm: cells } = it.map;
  if (!field) return null;
  const { length_mm: length, width_mm: width } = field,
    w = x[1] - x[0],
    h = y[1] - y[0],
    [wx, wy] = it.where,
    r = length / 60;
  return html`<svg
    class="agreement-map"
    viewBox=${`${-length / 2 - 2 * r} ${-width / 2 - 2 * r} ${length + 4 * r} ${width + 4 * r}`}
    role="img"
    aria-label=${t("pair.agreement.map", { worst: mm(it.max_mm), x: number(wx, 0), y: number(wy, 0) })}
  >
    ${cells.flatMap((row, j) =>
      row.map(
        (v, i) =>
          v !== null && html`<rect
            key=${`${i},${j}`}
            x=${x[i] - w / 2}
            y=${-y[j] - h / 2}
            width=${w}
            height=${h}
            fill=${shadeOf(v)}
          >
            <title>${mm(v)} mm</title>
          </rect>`,
      ),
    )}
    ${field.lines.map((l) => 
      html`<path key=${l.name} class="paint" d=${`M${l.from[0]} ${-l.from[1]}L${l.to[0]} ${-l.to[1]}`} />`)}
    <path
      class="where"
      d=${`M${wx - r} ${-wy - r}L${wx + r} ${-wy + r}M${wx - r} ${-wy + r}L${wx + r} ${-wy - r}`}
    />
  </svg>`;
}

/** @param {{ it: PairAnswer }} props */
function Epipolar({ it }) {
  const { fundamental: f, calibrated: c } = it,
    can = linesBases.value;
  return html`<section aria-label=${t("pair.epipolar.title")}>
    <${Title} of="epipolar">${t("pair.epipolar.title")}<//>
    ${f && html`
      <div class="verdict" data-testid="fundamental" data-level=${f.verdict.level}>
        <div class="big">
          ${number(f.rms_px, 2)}
          <small>${` ${t("pair.epipolar.rms")}`}</small>
        </div>
        <${Words} v=${f.verdict} />
      </div>
      ${f.outliers.length > 0 && html`<ul class="warnings" data-testid="mistakes">
        ${f.outliers.slice(0, SHOWN).map((index) => html`<li key=${index}>
          <b>
            ${t("pair.epipolar.mistake", { match: index + 1, error: number(f.epipolar_px[index], 1) })}
          </b>
          <div class="line">
            <button type="button" onClick=${() => choose(index)}>
              ${t("common.show-it")}
            </button>
            <button type="button" data-testid=${`drop-${index + 1}`} onClick=${() => removeMatch(index)}>
              ${t("pair.epipolar.remove")}
            </button>
          </div>
        </li>`)}
      </ul>`}
    `}
    ${c && html`<div class="plainly" data-testid="calibrated" data-level=${c.verdict.level}>
      <${Words} v=${c.verdict} />
    </div>`}
    ${can.matches && can.calibrations && html`<label class="pair">
      <span>${t("pair.epipolar.lines-by")}</span>
      <select
        data-testid="lines-by"
        value=${linesBasis.value}
        onChange=${(/** @type {any} */ e) => {
          chosenBasis.value = e.target.value;
        }}
      >
        <option value="matches">${t("pair.epipolar.by-matches")}</option>
        <option value="calibrations">${t("pair.epipolar.by-calibrations")}</option>
      </select>
    </label>`}
    ${f && html`<details class="more">
      <summary>${t("common.fundamental-matrix")}</summary>
      <pre data-testid="matrix">
        ${f.matrix.map((row) => row.map((v) => v.toExponential(6).padStart(14)).join(" ")).join("\n")}
      </pre>
    </details>`}
  </section>`;
}

/** @param {{ it: PairAnswer }} props */
function Pose({ it: { pose, calibrated } }) {
  const turn = (/** @type {number[]} */ v) => v.map((d) => number(d, 2)).join(", ");
  return html`<section aria-label=${t("pair.pose")}>
    <h2>${t("pair.pose.title")}</h2>
    <dl class="details" data-testid="pose">
      ${calibrated && html`
        <div>
          <dt>${t("pair.pose.left-from-right")}</dt>
          <dd>${calibrated.translation_mm.map((v) => number(v, 0)).join(", ")} mm</dd>
        </div>
        <div>
          <dt>${t("pair.pose.distance")}</dt>
          <dd data-testid="baseline">${number(calibrated.distance_mm, 0)} mm</dd>
        </div>
        <div>
          <dt>${t("pair.pose.turned-calibrations")}</dt>
          <dd>${number(calibrated.angle_deg, 2)}°</dd>
        </div>
        <div>
          <dt>${t("pair.pose.axes")}</dt>
          <dd>${turn(calibrated.rotation_deg)}°</dd>
        </div>
      `}
      ${pose && html`
        <div>
          <dt>${t("pair.pose.turned-matches")}</dt>
          <dd>
            ${number(pose.angle_deg, 2)}° ± ${number(pose.rotation_sigma_deg, 2)}°
          </dd>
        </div>
        <div>
          <dt>${t("pair.pose.axes")}</dt>
          <dd>${turn(pose.rotation_deg)}°</dd>
        </div>
        <div>
          <dt>${t("pair.pose.direction")}</dt>
          <dd>± ${number(pose.direction_sigma_deg, 2)}°</dd>
        </div>
        <div>
          <dt>${t("pair.pose.off-calibrations")}</dt>
          <dd>${number(pose.from_calibrations_deg.direction, 2)}°</dd>
        </div>
      `}
    </dl>
    ${pose && html`<div class="plainly" data-testid="pose-words">
      <${Words} v=${pose.verdict} />
    </div>`}
  </section>`;
}

const Advice = () => html`<section>
  <${Title} of="pair">${t("pair.advice.title")}<//>
  <ul class="plain">
    <li>
      ${both.value
        ? (
        ""
      )
        : html`
          ${rich("pair.advice.two-pictures")}${" "}
        `}
      ${rich("pair.advice.all-over")}
    </li>
    <li>
      ${rich("pair.advice.heights")}
    </li>
    <li>
      ${rich("pair.advice.twelve")}
    </li>
    <li>
      ${rich("pair.advice.calibrations")}
    </li>
  </ul>
</section>`;
