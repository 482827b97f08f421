// Finding the field's lines: the button, how far it is, and what it says.
import { plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { snapshot } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { finding, lastFound, notFound } from "../find_lines.js";

export function FindLines() {
  const now = finding.value,
    said = lastFound.value?.picture === snapshot.value?.id ? lastFound.value : null;
  return html`<section aria-label="Without clicks">
    <${Title} of="without-clicks">Without clicks<//>
    ${now
      ? html`<div class="line" role="status" data-testid="finding-lines">
        <progress max="1" value=${now.progress} aria-label="Finding the lines"></progress>
        <span>${now.message}</span>
        <${ActionButton} id="stop-lines" />
      </div>`
      : html`<div class="line">
        <${ActionButton} id="find-lines" />
      </div>`}
    ${!now && notFound.value && html`<p class="reason" role="alert" data-testid="lines-refused">
      ${notFound.value.detail} ${notFound.value.fix}
    </p>`}
    ${!now && said && html`<p class="reason" role="status" data-testid="lines-found">
      <b>${said.points ? `${plural(said.points, "point")} added.` : "Nothing was added."}</b>${" "}
      ${said.verdict.sentence} ${said.verdict.fix}
    </p>`}
  </section>`;
}
