// The one panel of the calibrating steps, at the right: what to do, the form for it, and what came of it.
import { DockedLoupe } from "../../../canvas/layers/loupe.js";
import { html } from "../../../core/html.js";
import { opening, step } from "../../../core/state.js";
import { FindLines } from "../../automatic/panels/find_lines.js";
import { Along, BordersPanel, InsidePanel } from "../../calibrate/panels/borders.js";
import { FieldFold, FieldPanel, PictureHelp } from "../../calibrate/panels/picture.js";
import { Presence } from "../../calibrate/panels/presence.js";
import { Details, Verdict } from "../../calibrate/panels/verdict.js";
import { preview } from "../../calibrate/fitting.js";
import { Tour } from "../../help/panels/tour.js";
import { Checklist } from "../../verify/panels/checklist.js";
import { VersionTools } from "../../versions/panels/versions.js";
import { Guide } from "./guide.js";

/** Its place is kept while a picture is opened, so that nothing jumps. */
export const StepPanel = () => html`
  <${DockedLoupe} />
  <${Tour} />
  ${
    !opening.value &&
    html`
    <${Step} />
    <${Presence} />
  `
  }
`;

function Step() {
  switch (step.value) {
    case "field":
      return html`
        <${Guide} />
        <${FindLines} />
        <${FieldPanel} />
        ${preview.value ? html`<${Verdict} /><${Details} />` : html`<${PictureHelp} />`}
      `;
    case "points":
      return html`
        <${Guide} />
        <${FindLines} />
        <${BordersPanel} />
        <${Along} />
        <${Verdict} />
        <div class="folds">
          <${InsidePanel} />
          <${Details} />
          <${FieldFold} />
        </div>
      `;
    default:
      return html`
        <${Checklist} />
        <${VersionTools} />
      `;
  }
}
