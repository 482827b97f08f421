// The place Field: the rigs there are, and the ways to look at several cameras at once.
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { fields } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { rigs } from "../rig.js";

export const FieldPage = () => html`<div class="page" data-testid="field-page">
  <h1>Cameras that share a field</h1>
  <p class="dim">
    A rig is the cameras above one field: their pictures in one, how far they agree, and what none of them sees.
  </p>
  <div class="line" data-testid="rigs">
    <${ActionButton} id="new-rig" />
    <${ActionButton} id="pair" />
  </div>
  <ul class="cards">
    ${rigs.value.map((r) => html`<li key=${r.name}>
      <a class="card" href=${addressOf("rig", { rig: r.name })} data-testid=${`rig-${r.name}`}>
        <b>${r.title || r.name}</b>
        <small>
          ${r.cameras.map((c) => c.title).join(" and ")},${" "}
          ${fields.value.find((f) => f.name === r.field)?.title ?? r.field}
        </small>
      </a>
    </li>`)}
  </ul>
</div>`;
