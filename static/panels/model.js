// Which model, and its options: the form is built from what the server says about them.
import { doc } from "../document.js";
import { many, mm, number } from "../format.js";
import { html } from "../html.js";
import { comparison, isFresh, notCompared, ranking, useModel } from "../ranking.js";
import { model, models } from "../state.js";
import { note } from "../versions.js";
import { OptionField } from "./options.js";
import { ActionButton } from "./toolbar.js";
import { Title } from "./title.js";

const NO_DISTORTION = "No significant distortion. ";

export function ModelPanel() {
  return html`<section aria-label="Model"><${Title} of="models">${ranking.value ? "Models, by error on the field" : "Model"}<//>
      <${Comparing}/><${Conclusion}/>
      <ul class=${`features${ranking.value && !isFresh() ? " stale" : ""}`} role="radiogroup" aria-label="Model" data-testid="models">
        ${ordered().map(({ name }) => html`<${Row} key=${name} name=${name}/>`)}</ul></section>
    ${model.value && html`<section aria-label="Options"><${Title} of="options">Options<//>
      ${model.value.options.map((option) => html`<${OptionField} key=${model.value?.name + option.name} option=${option}/>`)}</section>`}
    <section aria-label="Note"><h2>Note for this version</h2>
      <input type="text" data-testid="note" maxlength="2000" aria-label="Note for this version" placeholder="after the lens was cleaned" value=${note.value}
        onInput=${(/** @type {any} */ e) => { note.value = e.target.value; }}/></section>`;
}

/** How far the comparison is, or how to begin it again. */
function Comparing() {
  const now = comparison.value, why = notCompared.value?.why;
  if (now) return html`<div class="working" data-testid="comparing"><div class="line"><progress max="1" value=${now.progress} aria-label="Comparing the models"></progress><${ActionButton} id="stop-comparing"/></div>
    <p class="reason">${now.message || "Comparing the models…"}</p></div>`;
  if (!notCompared.value) return null;
  return html`<div class="working" data-testid="not-compared"><p class="reason">${why ? html`<b>${why.detail}</b> ${why.fix}` : "The models were not compared."}</p><${ActionButton} id="compare-models"/></div>`;
}

/** One model: what it would miss, or why it cannot be had. @param {{ name: string }} props */
function Row({ name }) {
  const it = models.value.find((m) => m.name === name), isOn = doc.value.model === name;
  const row = ranking.value?.ranking.find((r) => r.model === name), failed = ranking.value?.failed.find((f) => f.model === name);
  if (!it) return null;
  return html`<li role="presentation"><button type="button" class="feature model" role="radio" aria-checked=${isOn} data-testid=${`model-${name}`} title=${isOn ? it.title : `Use ${it.title}`} onClick=${() => useModel(name)}>
    <span class="dot" aria-hidden="true">${isOn ? "●" : "○"}</span><span>${it.title}</span><em class="value">${row ? `${mm(row.field_mm)} mm` : failed ? "–" : ""}</em>
    ${row && html`<small>${name === ranking.value?.recommended && html`<b class="level good">Recommended</b>, `}${many(row.parameters, "parameter")}</small>`}
    ${failed && html`<small data-testid=${`failed-${name}`}><b class="level fair">Cannot be fitted.</b> ${failed.what} ${failed.fix}</small>`}</button>
    ${isOn && html`<p class="reason">${it.help} ${it.points_needed}</p>`}
    ${isOn && row && html`<dl class="reason details" data-testid="model-details">${details(row).map(([what, value]) => html`<div key=${what}><dt>${what}</dt><dd>${value}</dd></div>`)}</dl>`}</li>`;
}

/** What the one figure is made of. @param {import("../types").Ranked} row @returns {[string, string][]} */
const details = (row) => /** @type {[string, string, number | null][]} */ ([
  ["Held out", `${mm(row.held_out_mm)} mm`, row.held_out_mm], ["Clicks it did not use", `${mm(row.check_mm)} mm`, row.check_mm],
  ["From the best camera with rays", `${mm(row.apart_mm)} mm`, row.apart_mm],
  ["Expected on the carpet", `${mm(row.expected_mm)} mm`, row.expected_mm], [`Expected at hat height${row.hat_height_mm ? `, ${row.hat_height_mm} mm` : ""}`, `${mm(row.expected_hat_mm)} mm`, row.expected_hat_mm],
  ["Residual", `${number(row.rms_px, 2)} px`, row.rms_px],
]).filter(([, , value]) => value !== null).map(([what, value]) => [what, value]);

/** What the comparison says, in a sentence. */
function Conclusion() {
  const now = ranking.value;
  if (!now) return null;
  const best = models.value.find((m) => m.name === now.recommended);
  return html`${now.no_significant_distortion && html`<p class="plainly" data-testid="no-distortion"><b>No significant distortion.</b> A camera without any lens would do as well.</p>`}
    <p class=${isFresh() ? "reason" : "reason stale"} data-testid="ranking">${now.reason.replace(NO_DISTORTION, "")}</p>
    ${best && best.name !== doc.value.model && html`<div class="line use"><${ActionButton} id="use-recommended" label=${`Use ${best.title}`}/></div>`}`;
}

/** The models, best first once that is known; those that cannot be fitted last. */
function ordered() {
  const place = new Map(ranking.value?.ranking.map((r, i) => [r.model, i]));
  return models.value.toSorted((a, b) => (place.get(a.name) ?? models.value.length) - (place.get(b.name) ?? models.value.length));
}
