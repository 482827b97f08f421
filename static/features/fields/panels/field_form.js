// Left of the drawing: what the field is called, how large it is, which parts cameras see, and what to do with it.
import { address } from "../../../core/api.js";
import { areaTitle } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { cameras } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { Outdated } from "../../versions/panels/outdated.js";
import { nameOf } from "../document.js";
import { chosen, history, isDirty, isShipped, opened, refusal, sizing, theirs } from "../editor.js";
import { includes, withSize } from "../geometry.js";
import { applyToCamera, deleteField, saveOverTheirs, takeTheirs } from "../saving.js";
import { NumberInput, TextInput } from "./numbers.js";

/** @typedef {import("../types").FieldDoc} FieldDoc */

const SIZES_MM = /** @type {[number, number]} */ ([500, 100_000]); // of fields

export function FieldForm() {
  const doc = history.doc.value;
  if (!doc) return null;
  return html`
    <${Refused} />
    ${opened.value?.name && html`<${Outdated} field=${opened.value.name} />`}
    <section aria-label=${t("field-editor.form.name")}>
      <${Title} of="own-field">${t("field-editor.form.heading")}<//>
      <${TextInput}
        label=${t("field-editor.form.title")}
        entry="title"
        value=${doc.title}
        set=${(/** @type {FieldDoc} */ d, /** @type {string} */ title) => ({
          ...d,
          title,
          name:
            opened.value?.name || (d.name && d.name !== nameOf(d.title) ? d.name : nameOf(title)),
        })}
      />
      ${
        !opened.value?.name &&
        html`<${TextInput}
        label=${t("field-editor.form.short-name")}
        entry="name"
        value=${doc.name}
        set=${(/** @type {FieldDoc} */ d, /** @type {string} */ name) => ({ ...d, name })}
      />`
      }
    </section>
    <section aria-label=${t("field-editor.form.size")}>
      <h2>${t("field-editor.form.size")}</h2>
      <${NumberInput}
        label=${t("field-editor.form.length")}
        entry="length_mm"
        range=${SIZES_MM}
        value=${doc.length_mm}
        set=${(/** @type {FieldDoc} */ d, /** @type {number} */ length) =>
          length > 0 ? withSize(d, length, d.width_mm, sizing.value) : d}
      />
      <${NumberInput}
        label=${t("field-editor.form.width")}
        entry="width_mm"
        range=${SIZES_MM}
        value=${doc.width_mm}
        set=${(/** @type {FieldDoc} */ d, /** @type {number} */ width) =>
          width > 0 ? withSize(d, d.length_mm, width, sizing.value) : d}
      />
      <label class="pair tall">
        <span>${t("field-editor.form.sizing")}</span>
        <select
          data-testid="sizing"
          value=${sizing.value}
          disabled=${isShipped.value}
          onChange=${(/** @type {any} */ e) => {
            sizing.value = e.target.value;
          }}
        >
          <option value="scale">${t("field-editor.form.sizing-scale")}</option>
          <option value="borders">${t("field-editor.form.sizing-borders")}</option>
        </select>
      </label>
      <${NumberInput}
        label=${t("field-editor.form.line-width")}
        entry="line_width_mm"
        value=${doc.lines[0]?.width_mm ?? doc.arcs[0]?.width_mm ?? 50}
        set=${(/** @type {FieldDoc} */ d, /** @type {number} */ width_mm) => ({
          ...d,
          lines: d.lines.map((l) => ({ ...l, width_mm })),
          arcs: d.arcs.map((a) => ({ ...a, width_mm })),
        })}
      />
      <${NumberInput}
        label=${t("field-editor.form.robot-height")}
        entry="hat_height_mm"
        value=${doc.hat_height_mm}
        set=${(/** @type {FieldDoc} */ d, /** @type {number} */ hat_height_mm) => ({ ...d, hat_height_mm })}
      />
      <${NumberInput}
        label=${t("field-editor.form.line-error")}
        entry="line_sigma_mm"
        value=${doc.line_sigma_mm}
        set=${(/** @type {FieldDoc} */ d, /** @type {number} */ line_sigma_mm) => ({ ...d, line_sigma_mm })}
      />
    </section>
    <${Parts} doc=${doc} />
    <${Uses} doc=${doc} />
  `;
}

/** What was refused, or what somebody else has saved. */
function Refused() {
  const why = refusal.value,
    other = theirs.value;
  return html`
    ${
      why &&
      html`<div class="warning-line" role="alert" id="field-refusal" data-testid="field-refusal">
      <b>${why.detail}</b> ${why.fix}
    </div>`
    }
    ${
      other &&
      html`<div class="warning-line" role="alert" data-testid="field-theirs">
      <b>${other.field ? t("field-editor.theirs.changed") : t("field-editor.theirs.deleted")}</b>
      <p>${t("field-editor.theirs.yours-kept")}</p>
      <div class="line wrap">
        ${
          other.field &&
          html`<button type="button" data-testid="take-theirs" onClick=${takeTheirs}>
          ${t("field-editor.theirs.show")}
        </button>`
        }
        <button type="button" data-testid="save-over" onClick=${() => void saveOverTheirs()}>
          ${t("field-editor.theirs.save-over")}
        </button>
      </div>
    </div>`
    }
  `;
}

/** @param {{ doc: FieldDoc }} props */
const Parts = ({ doc }) => html`<section aria-label=${t("field-editor.parts")}>
  <h2>${t("field-editor.parts")}</h2>
  <ul class="features">
    ${Object.keys(doc.regions).map((name) => {
      const mark = /** @type {const} */ ({ kind: "region", name });
      return html`<li key=${name}>
        <button
          type="button"
          class="feature model"
          data-testid=${`mark-region-${name}`}
          aria-pressed=${includes(chosen.value, mark)}
          onClick=${() => {
            chosen.value = [mark];
          }}
        >
          <i></i>
          <span>${areaTitle(name)}</span>
        </button>
      </li>`;
    })}
  </ul>
  <${ActionButton} id="add-region" />
</section>`;

/** @param {{ doc: FieldDoc }} props */
function Uses({ doc }) {
  const name = opened.value?.name;
  if (!name) return null;
  const others = cameras.value.filter((c) => c.editable && c.field !== name),
    over = cameras.value.filter((c) => c.field === name).map((c) => c.name);
  return html`<section aria-label=${t("field-editor.use.heading")}>
    <h2>${t("field-editor.use.heading")}</h2>
    <p class="reason">
      ${
        over.length
          ? t("field-editor.use.under", { cameras: over.join(", ") })
          : t("field-editor.use.no-camera")
      }
    </p>
    ${
      others.length > 0 &&
      html`<label class="pair tall">
      <span>${t("field-editor.use.hang")}</span>
      <select
        data-testid="use-for"
        value=""
        onChange=${(/** @type {any} */ e) => {
          void applyToCamera(e.target.value);
          e.target.value = "";
        }}
      >
        <option value="">${t("field-editor.choose-camera")}</option>
        ${others.map(
          (c) => html`<option key=${c.id} value=${c.id}>
          ${c.name}
        </option>`,
        )}
      </select>
    </label>`
    }
    <div class="line wrap">
      <${ActionButton} id="copy-field" />
      <a href=${address(`/fields/${name}/export/json`)} download>${t("field-editor.use.json")}</a>
      <a href=${address(`/fields/${name}/export/ssl-vision`)} download>${t("field-editor.use.ssl-vision")}</a>
      <a href=${address(`/fields/${name}/export/vision-processor`)} download>
        ${t("field-editor.use.vision-processor")}
      </a>
      ${
        !isShipped.value &&
        html`<button
        type="button"
        data-testid="delete-field"
        title=${t("field-editor.use.delete-title", { title: doc.title })}
        onClick=${() => void deleteField()}
      >
        ${t("field-editor.use.delete")}
      </button>`
      }
    </div>
    ${isDirty.value && html`<p class="reason">${t("field-editor.use.as-saved")}</p>`}
  </section>`;
}
