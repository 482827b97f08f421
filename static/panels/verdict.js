// What the clicks are worth: a length first, a sentence second, details third; every warning with its cure.
import { BORDERS, doc } from "../document.js";
import { activateFeature, remove, select } from "../editing.js";
import { curves, isCurve, preview, refusal, stale } from "../fitting.js";
import { many, mm, number, pct, words } from "../format.js";
import { html } from "../html.js";
import { colour } from "../layers/drawing.js";
import { field, model, snapshot, step } from "../state.js";
import { Residuals } from "./residuals.js";
import { Title } from "./title.js";

const STANDARD_PCT = 3; // Eq. (9): a standard lens is within ±3 %
const SHOWN = 2; // warnings; the others open on demand, so that the figures stay in sight
const LEVEL = { good: "Good", fair: "Fair", poor: "Poor", unknown: "Not known inside" };

/** @param {{ report?: import("../types").Report }} props a saved version's report, else the present one */
export function Verdict({ report }) {
  const it = report ?? preview.value?.report, why = report ? null : refusal.value;
  return html`<section aria-label="Verdict"><${Title} of="verdict">Verdict<//>
    <div class=${`verdict${!report && stale.value ? " stale" : ""}`} data-testid="verdict" data-level=${it?.verdict.level ?? ""} aria-live="polite">
      ${it ? html`<div class="big">${mm(it.verdict.mm)}<small> mm ${it.sigma_mm && it.verdict.mm === it.sigma_mm.rms ? "expected error" : "held-out error"}</small></div>
        <p><b class=${`level ${it.verdict.level}`}>${LEVEL[it.verdict.level]}.</b> ${it.verdict.sentence}</p>
        <dl>${it.sigma_mm ? html`<div><dd>${mm(it.sigma_mm.rms)} mm</dd><dt>carpet</dt></div>${it.sigma_mm.hat && html`<div><dd>${mm(it.sigma_mm.hat.rms)} mm</dd><dt>hats, ${it.sigma_mm.hat.z_mm} mm</dt></div>`}`
          : html`<div><dd>${mm(it.rms_mm)} mm</dd><dt>borders</dt></div><div><dd>${mm(it.max_mm)} mm</dd><dt>worst click</dt></div>`}
          <div><dd data-testid="rms-px">${number(it.rms_px, 2)} px</dd><dt>residual</dt></div></dl>`
      : why ? html`<div class="big dim">– <small>mm</small></div><p data-testid="missing"><b>${why.detail}</b> ${why.fix}</p>`
        : html`<div class="big dim">– <small>mm</small></div><p>${snapshot.value ? "Click along the four borders; the verdict grows with every point." : "Open a picture first."}</p>`}
    </div>
    ${it && html`<${Warnings} warnings=${it.warnings} canFix=${!report}/>`}
  </section>`;
}

/** @param {{ warnings: import("../types").Warning[], canFix: boolean }} props */
function Warnings({ warnings, canFix }) {
  const item = (/** @type {import("../types").Warning} */ w) => html`<${WarningItem} key=${w.reason + w.feature + w.index + w.text} w=${w} canFix=${canFix}/>`;
  return html`<ul class="warnings" data-testid="warnings">${warnings.slice(0, SHOWN).map(item)}</ul>
    ${warnings.length > SHOWN && html`<details class="more"><summary>Show ${many(warnings.length - SHOWN, "more warning")}</summary><ul class="warnings">${warnings.slice(SHOWN).map(item)}</ul></details>`}`;
}

/** @param {{ w: import("../types").Warning, canFix: boolean }} props */
function WarningItem({ w, canFix }) {
  return html`<li data-reason=${w.reason}>
    <b>${w.text}</b> ${w.fix}
    ${canFix && w.feature !== null && w.index !== null && html`<${StrayButtons} feature=${w.feature} index=${w.index}/>`}
    ${canFix && w.reason === "inside-not-checked" && field.value?.arcs.some((a) => a.name === "centre-circle")
      && html`<div class="line"><button type="button" onClick=${() => activateFeature("centre-circle")}>Click the centre circle</button></div>`}
    ${canFix && w.reason === "height-unknown" && model.value?.options.some((o) => o.name === "height_mm")
      && html`<div class="line"><button type="button" data-testid="enter-height" onClick=${() => void enterHeight()}>Enter camera height…</button></div>`}
  </li>`;
}

/** To the field where the cure goes. */
async function enterHeight() {
  step.value = "model";
  await new Promise(requestAnimationFrame); // once it is drawn
  const input = document.getElementById("option-height_mm");
  input?.scrollIntoView({ block: "center" });
  input?.focus();
}

/** @param {{ feature: string, index: number }} pick */
function StrayButtons(pick) {
  return html`<div class="line"><button type="button" data-testid="remove-stray" onClick=${() => remove([{ feature: pick.feature, index: pick.index }])}>Remove this point</button>
    <button type="button" onClick=${() => select([{ feature: pick.feature, index: pick.index }])}>Show it</button></div>`;
}

/** How bent each border is, of ±3 %. */
export function Distortion() {
  const bent = BORDERS.map((border) => ({ border, curve: curves.value[border] }));
  const all = preview.value?.report.distortion, values = bent.flatMap(({ curve }) => (isCurve(curve) ? [Math.abs(curve.distortion_pct)] : []));
  const full = Math.max(1.5 * STANDARD_PCT, ...values.map((v) => 1.1 * v)), half = (/** @type {number} */ v) => (50 * Math.abs(v)) / full;
  return html`<section aria-label="Distortion"><${Title} of="distortion">Distortion, of ±${STANDARD_PCT} % for a standard lens<//>
    ${bent.map(({ border, curve }) => {
      const v = isCurve(curve) ? curve.distortion_pct : null;
      return html`<div key=${border} class="bar-row" data-testid=${`distortion-${border}`}><i class="chip" style=${`--colour:${colour(border)}`}>${border[0].toUpperCase()}</i><span>${words(border)}</span>
        <div class="bar" aria-hidden="true"><s style=${`left:${50 - half(STANDARD_PCT)}%`}></s><s style=${`left:${50 + half(STANDARD_PCT)}%`}></s><s class="zero"></s>
          ${v !== null && html`<b class=${Math.abs(v) > STANDARD_PCT ? "over" : ""} style=${`left:${v < 0 ? 50 - half(v) : 50}%;width:${half(v)}%`}></b>`}</div>
        <em>${v === null ? "–" : `${pct(v)} %`}</em></div>`;
    })}
    ${all && html`<p class="reason" data-testid="distortion">${words(all.kind === "none" ? "no clear bend" : all.kind)}: ${pct(all.before_pct)} % before, ${pct(all.after_pct)} % after correction.</p>`}
  </section>`;
}

export const Figures = () => html`<${Verdict}/><${Distortion}/>${doc.value.observations.length > 0 && html`<${Residuals}/>`}`;
