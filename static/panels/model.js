// Which model, and its options: the form is built from what the server says about them.
import { change, doc } from "../document.js";
import { mm } from "../format.js";
import { html } from "../html.js";
import { ranking } from "../ranking.js";
import { model, models } from "../state.js";
import { note } from "../versions.js";
import { OptionField } from "./options.js";

export function ModelPanel() {
  const now = ranking.value, best = now?.recommended;
  return html`<section aria-label="Model"><h2>${now ? "Models, by error on the field" : "Model"}</h2>
      <ul class="features" role="radiogroup" aria-label="Model" data-testid="models">${ordered().map(({ name, title, help, points_needed }) => {
        const isOn = doc.value.model === name, error = now?.ranking.find((r) => r.model === name)?.field_mm;
        return html`<li key=${name}><button type="button" class="feature model" role="radio" aria-checked=${isOn} data-testid=${`model-${name}`}
            onClick=${() => change({ ...doc.value, model: name, options: {} })}>
          <span class="dot" aria-hidden="true">${isOn ? "●" : "○"}</span><span>${title}</span><em class="value">${now ? `${mm(error)} mm` : ""}</em>
          ${name === best && html`<small class="level good">Recommended</small>`}</button>
          ${isOn && html`<p class="reason">${help} ${points_needed}</p>`}</li>`;
      })}</ul>${now && html`<p class="reason" data-testid="ranking">${now.reason}</p>`}</section>
    ${model.value && html`<section aria-label="Options"><h2>Options</h2>
      ${model.value.options.map((option) => html`<${OptionField} key=${model.value?.name + option.name} option=${option}/>`)}</section>`}
    <section aria-label="Note"><h2>Note for this version</h2>
      <input type="text" data-testid="note" maxlength="2000" aria-label="Note for this version" placeholder="after the lens was cleaned" value=${note.value}
        onInput=${(/** @type {any} */ e) => { note.value = e.target.value; }}/></section>`;
}

/** The models, best first once that is known. */
function ordered() {
  const place = new Map(ranking.value?.ranking.map((r, i) => [r.model, i]));
  return models.value.toSorted((a, b) => (place.get(a.name) ?? models.value.length) - (place.get(b.name) ?? models.value.length));
}
