// The lens model, chosen automatically unless the operator chooses: closed until asked for. The options are built from
// what the server says about them.
import { doc } from "../../../core/document.js";
import { html } from "../../../core/html.js";
import { model } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Fold } from "../../../ui/fold.js";
import { Title } from "../../../ui/title.js";
import { askedHeight } from "../camera_height.js";
import { ModelTable } from "./model_table.js";
import { OptionField } from "./options.js";

export function LensModel() {
  const it = model.value;
  const automatic = it
    ? t("calibrate.model.automatic-now", { model: it.title })
    : t("calibrate.model.automatic");
  const name = doc.value.model === null ? automatic : it?.title;
  return html`<${Fold}
    id="lens"
    title=${t("calibrate.model.title")}
    value=${html`<b data-testid="model-now">${name}</b>`}
  >
    <div class="line">
      <${ActionButton} id="model-automatic" />
    </div>
    <${ModelTable} />
    ${
      it &&
      html`
      <section aria-label=${t("calibrate.model.options")}>
        <${Title} of="options">${t("calibrate.model.options")}<//>
        <p class="reason">
          ${it.help} ${it.points_needed}
        </p>
        ${it.options
          .filter((option) => option !== askedHeight.value) // it stands beside the accuracy
          .map((option) => html`<${OptionField} key=${it.name + option.name} option=${option} />`)}
      </section>
    `
    }
  <//>`;
}
