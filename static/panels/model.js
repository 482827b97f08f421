// Which model, and its options: the form is built from what the server says about them.
import { change, doc } from "../document.js";
import { preview, stale } from "../fitting.js";
import { mm } from "../format.js";
import { html } from "../html.js";
import { model, models } from "../state.js";
import { note } from "../versions.js";

/** @typedef {import("../types").Option} Option */

export function ModelPanel() {
  return html`<section aria-label="Model"><h2>Model</h2>
      <ul class="features" role="radiogroup" aria-label="Model">${models.value.map(({ name, title, help, points_needed }) => {
        const isOn = doc.value.model === name;
        return html`<li key=${name}><button type="button" class="feature model" role="radio" aria-checked=${isOn} data-testid=${`model-${name}`}
            onClick=${() => change({ ...doc.value, model: name, options: {} })}>
          <span class="dot" aria-hidden="true">${isOn ? "●" : "○"}</span><span>${title}</span><em class="value">${isOn && preview.value && !stale.value ? `${mm(preview.value.report.verdict.mm)} mm` : ""}</em></button>
          ${isOn && html`<p class="reason">${help} ${points_needed}</p>`}</li>`;
      })}</ul></section>
    ${model.value && html`<section aria-label="Options"><h2>Options</h2>
      ${model.value.options.map((option) => html`<${Field} key=${model.value?.name + option.name} option=${option}/>`)}</section>`}
    <section aria-label="Note"><h2>Note for this version</h2>
      <input type="text" data-testid="note" maxlength="2000" aria-label="Note for this version" placeholder="after the lens was cleaned" value=${note.value}
        onInput=${(/** @type {any} */ e) => { note.value = e.target.value; }}/></section>`;
}

/** @param {{ option: Option }} props */
function Field({ option }) {
  const { name, unit, help } = option, id = `option-${name}`;
  return html`<div class="option"><label class="pair" for=${id}><span>${label(name)}</span><span class="with-unit"><${Control} id=${id} option=${option}/>${unit && html`<small>${unit}</small>`}</span></label>
    <p class="reason" id=${`${id}-help`}>${help}${range(option)}</p></div>`;
}

/** "w_max_rectangle_px" → "W max rectangle"; the unit stands beside the field. @param {string} name */
function label(name) {
  const text = name.replace(/_(px|mm|deg|pct)$/, "").replaceAll("_", " ");
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** @param {Option} option */
const range = ({ range: r, type }) => (r ? ` ${type.endsWith("-or-auto") ? "Auto, or " : ""}${r[0]} to ${r[1]}.` : "");

/** @param {{ id: string, option: Option }} props */
function Control({ id, option }) {
  const { name, type, default: fallback, choices, range: r } = option, value = doc.value.options[name] ?? fallback;
  /** @param {unknown} v */
  const set = (v) => {
    const { [name]: _, ...others } = doc.value.options;
    change({ ...doc.value, options: v === null || v === fallback ? others : { ...others, [name]: v } });
  };
  const about = { id, "data-testid": id, "aria-describedby": `${id}-help` };
  if (type === "bool") return html`<input type="checkbox" ...${about} checked=${Boolean(value)} onChange=${(/** @type {any} */ e) => set(e.target.checked)}/>`;
  const few = type === "int-or-auto" && r && r[1] - r[0] <= 20 ? ["auto", ...Array.from({ length: r[1] - r[0] + 1 }, (_, i) => String(r[0] + i))] : choices;
  if (type === "choice" || few.length) return html`<select ...${about} value=${String(value)} onChange=${(/** @type {any} */ e) => set(type === "choice" || e.target.value === "auto" ? e.target.value : Number(e.target.value))}>
    ${few.map((c) => html`<option key=${c} value=${c}>${c === "auto" ? "Auto" : c}</option>`)}</select>`;
  return html`<input type="number" ...${about} step=${type.startsWith("int") ? 1 : "any"} min=${r?.[0]} max=${r?.[1]} placeholder="Auto" value=${value === "auto" ? "" : value}
    onChange=${(/** @type {any} */ e) => set(e.target.value === "" ? null : Number(e.target.value))}/>`;
}
