// Automatic detection of the field's lines: how far it is, what it says, and the button to detect again.
import { doc } from "../../../core/document.js";
import { plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { finding, lastFound, notFound } from "../find_lines.js";
import { offered } from "../line_suggestions.js";

export function FindLines() {
  const now = finding.value,
    said = lastFound.value,
    isOffered = offered.value.length > 0;
  return html`<section aria-label="Automatic detection">
    <${Title} of="without-clicks">Automatic detection<//>
    ${now
      ? html`<div class="line" role="status" data-testid="finding-lines">
        <progress max="1" value=${now.progress} aria-label="Detecting the field lines"></progress>
        <span>${now.message}</span>
        <${ActionButton} id="stop-lines" />
      </div>`
      : html`<div class="line">
        <${ActionButton} id="find-lines" label=${doc.value.observations.length ? "Detect again" : "Detect lines"} />
        <${ActionButton} id="auto-detect" />
      </div>`}
    ${!now && notFound.value && html`<p class="reason" role="alert" data-testid="lines-refused">
      ${notFound.value.detail} ${notFound.value.fix}
    </p>`}
    ${!now && said && html`<p class="reason" role="status" data-testid="lines-found">
      <b>
        ${said.points
          ? `Detected ${plural(said.points, "point")}.`
          : isOffered
          ? "The detection is not sure. Check the dashed points below."
          : "No points were added."}
      </b>${" "}
      ${said.verdict.sentence} ${said.verdict.fix}
    </p>`}
  </section>`;
}
