// The lens model, chosen automatically unless the operator chooses: closed until asked for. The options are built from
// what the server says about them.
import { doc } from "../../../core/document.js";
import { html } from "../../../core/html.js";
import { model } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Fold } from "../../../ui/fold.js";
import { Title } from "../../../ui/title.js";
import { askedHeight } from "../camera_height.js";
import { ModelTable } from "./model_table.js";
import { OptionField } from "./options.js";

export function LensModel() {
  const it = model.value;
  const name = doc.value.model === null ? `Automatic${it ? ` (${it.title})` : ""}` : it?.title;
  return html`<${Fold} id="lens" title="Lens model" value=${html`<b data-testid="model-now">${name}</b>`}>
    <div class="line">
      <${ActionButton} id="model-automatic" />
    </div>
    <${ModelTable} />
    ${it && html`
      <section aria-label="Options">
        <${Title} of="options">Options<//>
        <p class="reason">
          ${it.help} ${it.points_needed}
        </p>
        ${it.options
          .filter((option) => option !== askedHeight.value) // it stands beside the accuracy
          .map((option) => html`<${OptionField} key=${it.name + option.name} option=${option} />`)}
      </section>
    `}
  <//>`;
}
