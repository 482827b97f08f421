// Another model that describes the points better than the one that was saved at once: offered when it is known.
import { html } from "../../../core/html.js";
import { mm } from "../../../core/format.js";
import { modelTitle } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Comparing } from "../../calibrate/panels/model_table.js";
import { offer } from "../model_offer.js";

export function ModelOffer() {
  const { isComparing, better } = offer.value;
  if (isComparing)
    return html`<section>
      <h2>${t("calibrate.model-table.comparing")}</h2>
      <${Comparing} />
    </section>`;
  if (!better) return null;
  const name = modelTitle(better.name);
  return html`<div class="question" data-testid="model-offer" role="status">
      <p>
        ${t("verify.better-model", {
          model: name,
          mm: mm(better.mm),
          now: modelTitle(better.former),
          now_mm: mm(better.former_mm),
        })}
      </p>
      <div class="line">
        <${ActionButton} id="save-recommended" label=${t("calibrate.model-table.use", { model: name })} />
      </div>
    </div>`;
}
