// The place Field: the rigs there are, and the ways to look at several cameras at once.
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { fields } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { rigs } from "../rig.js";

export const FieldPage = () => html`<div class="page" data-testid="field-page">
  <h1>${t("rig.field.title")}</h1>
  <p class="dim">${t("rig.field.what")}</p>
  <div class="line" data-testid="rigs">
    <${ActionButton} id="new-rig" />
  </div>
  <ul class="cards">
    ${rigs.value.map(
      (r) => html`<li key=${r.name}>
      <a class="card" href=${addressOf("rig", { rig: r.name })} data-testid=${`rig-${r.name}`}>
        <b>${r.title || r.name}</b>
        <small>
          ${r.cameras.map((c) => c.title).join(t("rig.and"))},${" "}
          ${fields.value.find((f) => f.name === r.field)?.title ?? r.field}
        </small>
      </a>
    </li>`,
    )}
  </ul>
</div>`;
