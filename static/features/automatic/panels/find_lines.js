// Automatic detection of the field's lines: how far it is, what it says, the fields and areas to choose from, and the
// button to detect again.
import { doc } from "../../../core/document.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { offered } from "../../calibrate/line_suggestions.js";
import { Fixes } from "../../calibrate/panels/warnings.js";
import { ProposeField } from "../../fields/panels/propose_field.js";
import { finding, lastFound, notFound } from "../find_lines.js";
import { FieldChoices } from "./field_choices.js";

/** What is found where the image may show a field that is none of those known. */
const ANOTHER_FIELD = new Set([
  "no-known-field",
  "painted-elsewhere",
  "lines-missing",
  "lines-unexplained",
  "loose",
]);

export function FindLines() {
  const now = finding.value,
    said = lastFound.value,
    isOffered = offered.value.length > 0;
  return html`<section aria-label=${t("calibrate.find-lines-panel.title")}>
    <${Title} of="without-clicks">${t("calibrate.find-lines-panel.title")}<//>
    <${FieldChoices} />
    ${
      now
        ? html`<div class="line" role="status" data-testid="finding-lines">
        <progress max="1" value=${now.progress} aria-label=${t("calibrate.find-lines-panel.progress")}></progress>
        <span>${now.message}</span>
        <${ActionButton} id="stop-lines" />
      </div>`
        : html`<div class="line">
        <${ActionButton}
          id="find-lines"
          label=${
            doc.value.observations.length
              ? t("calibrate.find-lines-panel.again")
              : t("calibrate.find-lines-panel.detect")
          }
        />
        <${ActionButton} id="auto-detect" />
      </div>`
    }
    ${
      !now &&
      notFound.value &&
      html`<p class="reason" role="alert" data-testid="lines-refused">
      ${notFound.value.detail} ${notFound.value.fix}
    </p>
    <${Fixes} trouble=${notFound.value} />`
    }
    ${
      !now &&
      said &&
      said.choices.length === 0 &&
      html`<p class="reason" role="status" data-testid="lines-found">
      <b>
        ${
          said.points
            ? t("calibrate.find-lines-panel.detected", { count: said.points })
            : isOffered
              ? t("calibrate.find-lines-panel.not-sure")
              : t("calibrate.find-lines-panel.nothing-added")
        }
      </b>
      ${(!said.points || said.verdict.fix) && ` ${said.verdict.sentence} ${said.verdict.fix}`}
    </p>
    <${Fixes} trouble=${said.verdict} />
    ${ANOTHER_FIELD.has(said.verdict.reason) && html`<${ProposeField} />`}`
    }
  </section>`;
}
