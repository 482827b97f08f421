// The fields and areas of which an image shows one: each with a drawing of the whole field that marks the area.
import { areaName, areaTitle } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { fields } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { arcPoints, rectOf, turned } from "../../calibrate/field_sides.js";
import { fieldChoices, useChoice } from "../find_lines.js";

/** @typedef {import("../../../core/types").Point} Point */

const ARROW = 0.22; // of the area's shorter side

export function FieldChoices() {
  const choices = fieldChoices.value;
  return (
    choices.length > 0 &&
    html`<ul class="field-choices" data-testid="field-choices">
      ${choices.map(
        (choice) => html`<li key=${`${choice.field} ${choice.region} ${choice.rotate}`}>
        <button
          type="button"
          data-testid=${`choice-${choice.field}-${choice.region}`}
          aria-label=${t("calibrate.field-choices.use", { field: choice.title, area: areaName(choice.region) })}
          onClick=${() => void useChoice(choice)}
        >
          <${Drawing} ...${choice} />
          <b>${areaTitle(choice.region)}</b>
          <small>${choice.title}, ${t("calibrate.picture.turned", { degrees: choice.rotate })}</small>
        </button>
      </li>`,
      )}
    </ul>`
  );
}

/** The whole field as its file has it, so that areas of one field can be told apart; the arrow points to where the
 * image has its top. @param {import("../find_lines.js").FieldChoice} props */
function Drawing({ field: name, region: area, rotate }) {
  const f = fields.value.find((it) => it.name === name),
    r = f?.regions[area];
  if (!f || !r) return null;
  const all = Object.values(f.regions).map((it) => rectOf(it, 0)),
    left = Math.min(...all.map((it) => it.x)),
    top = Math.min(...all.map((it) => it.y)),
    width = Math.max(...all.map((it) => it.x + it.width)) - left,
    height = Math.max(...all.map((it) => it.y + it.height)) - top;
  const place = (/** @type {Point} */ p) => turned(p, 0).join(" "),
    part = rectOf(r, 0),
    size = ARROW * Math.min(part.width, part.height);
  return html`<svg viewBox=${`${left} ${top} ${width} ${height}`} aria-hidden="true">
    <rect class="carpet" x=${left} y=${top} width=${width} height=${height} />
    ${f.lines.map((l) => html`<path key=${l.name} d=${`M${place(l.from)}L${place(l.to)}`} />`)}
    ${f.arcs.map((a) => html`<path key=${a.name} d=${`M${arcPoints(a).map(place).join("L")}`} />`)}
    <rect class="part" ...${part} />
    <path
      class="up"
      transform=${`translate(${part.x + part.width / 2} ${part.y + part.height / 2}) rotate(${rotate})`}
      d=${`M0 ${size}V${-size}M${-0.6 * size} ${-0.3 * size}L0 ${-size}L${0.6 * size} ${-0.3 * size}`}
    />
  </svg>`;
}
