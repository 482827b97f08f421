// Library, Fields: those of one's own and those that come with Touchline, each drawn small.
import { address } from "../../../core/api.js";
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { cameras, fields } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { rich } from "../../../ui/rich.js";
import { arcPoints } from "../../calibrate/field_sides.js";
import { Outdated } from "../../versions/panels/outdated.js";
import { openFieldFile } from "../editor.js";

/** @typedef {import("../../../core/types").Field} Field */

export function FieldsPage() {
  const own = fields.value.filter((f) => f.own),
    shipped = fields.value.filter((f) => !f.own);
  return html`<div class="page" data-testid="fields-page">
    <h1>${t("field-editor.list.heading")}</h1>
    <p class="dim">${t("field-editor.list.explained")}</p>
    <div class="line wrap">
      <${ActionButton} id="new-field" />
      <label class="as-button choose-field">
        ${t("field-editor.list.open-file")}
        <input
          type="file"
          class="sr"
          data-testid="field-file"
          accept=".json,.pb"
          onChange=${(/** @type {{ target: HTMLInputElement }} */ { target }) => {
            const file = target.files?.[0];
            if (file) void openFieldFile(file);
            target.value = "";
          }}
        />
      </label>
    </div>
    ${
      own.length > 0 &&
      html`<section aria-label=${t("field-editor.list.yours")}>
      <h2>${t("field-editor.list.yours")}</h2>
      <ul class="field-cards">
        ${own.map((f) => html`<${Card} key=${f.name} it=${f} />`)}
      </ul>
    </section>`
    }
    <section aria-label=${t("field-editor.list.shipped")}>
      <h2>${t("field-editor.list.shipped-heading")}</h2>
      <ul class="field-cards">
        ${shipped.map((f) => html`<${Card} key=${f.name} it=${f} />`)}
      </ul>
    </section>
  </div>`;
}

/** @param {{ it: Field }} props */
function Card({ it }) {
  const { name, title, length_mm: length, width_mm: width, own } = it,
    over = cameras.value.filter((c) => c.field === name).map((c) => c.name),
    of = () => html`<span class="sr">${t("field-editor.card.of", { title })}</span>`;
  return html`<li class="card" data-testid=${`field-card-${name}`}>
    <a href=${addressOf("field-editor", { field: name })} data-testid=${`edit-field-${name}`}>
      <${Sketch} it=${it} />
      <b>${title}</b>
    </a>
    <small>
      ${number(length, 0)} × ${number(width, 0)} mm
      ${over.length > 0 && t("field-editor.card.under", { cameras: over.join(", ") })}
    </small>
    ${own && html`<${Outdated} field=${name} />`}
    <div class="line wrap">
      <a href=${addressOf("new-field", { field: name })} data-testid=${`copy-field-${name}`}>
        ${rich("field-editor.card.copy", { of: of() })}
      </a>
      <a href=${address(`/fields/${name}/export/json`)} download>
        ${rich("field-editor.card.json", { of: of() })}
      </a>
      <a href=${address(`/fields/${name}/export/ssl-vision`)} download>
        ${rich("field-editor.card.ssl-vision", { of: of() })}
      </a>
    </div>
  </li>`;
}

/** @param {{ it: Field }} props */
function Sketch({ it: { length_mm: length, width_mm: width, lines, arcs } }) {
  const room = 0.04 * length,
    box = [-length / 2 - room, -width / 2 - room, length + 2 * room, width + 2 * room];
  return html`<svg class="sketch" viewBox=${box.join(" ")} aria-hidden="true">
    <g transform="scale(1 -1)">
      ${lines.map((l) => html`<path key=${l.name} d=${`M${l.from.join(" ")}L${l.to.join(" ")}`} />`)}
      ${arcs.map(
        (a) =>
          html`<path key=${a.name} d=${`M${arcPoints(a)
            .map((p) => p.join(" "))
            .join("L")}`} />`,
      )}
    </g>
  </svg>`;
}
