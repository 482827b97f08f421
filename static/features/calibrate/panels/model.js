// The model that is used, and its options: the form is built from what the server says about them.
import { html } from "../../../core/html.js";
import { model } from "../../../core/state.js";
import { Title } from "../../../ui/title.js";
import { note } from "../../versions/versions.js";
import { OptionField } from "./options.js";

export function ModelPanel() {
  const it = model.value;
  return html`
    ${it && html`
      <section aria-label="Model">
        <h2>Model</h2>
        <p data-testid="model-now">
          <b>${it.title}</b>
        </p>
        <p class="reason">
          ${it.help} ${it.points_needed}
        </p>
      </section>
      <section aria-label="Options">
        <${Title} of="options">Options<//>
        ${it.options.map((option) => html`<${OptionField} key=${it.name + option.name} option=${option} />`)}
      </section>
    `}
    <section aria-label="Note">
      <h2>Note for this version</h2>
      <input
        type="text"
        data-testid="note"
        maxlength="2000"
        aria-label="Note for this version"
        placeholder="after the lens was cleaned"
        value=${note.value}
        onInput=${(/** @type {any} */ e) => {
          note.value = e.target.value;
        }}
      />
    </section>
  `;
}
