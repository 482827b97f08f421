// Which field the picture shows, which part of it, and how it stands.
import { doc } from "../../../core/document.js";
import { areaName, areaTitle, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { field, fields, region, rotation } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Fold } from "../../../ui/fold.js";
import { Title } from "../../../ui/title.js";
import { changePlace } from "../../automatic/find_lines.js";
import { onField } from "../editing.js";
import { FieldDrawing } from "./field_drawing.js";

const CHECKS = [
  t("calibrate.picture.check.drawing"),
  t("calibrate.picture.check.borders"),
  t("calibrate.picture.check.part"),
];
const ADVICE = [
  t("calibrate.picture.advice.mounted"),
  t("calibrate.picture.advice.whole-part"),
  t("calibrate.picture.advice.sharp"),
  t("calibrate.picture.advice.size"),
];

export function FieldPanel() {
  const f = field.value;
  return html`<section aria-label=${t("calibrate.picture.field")}>
    <${Title} of="field">${t("calibrate.picture.field")}<//>
    <label class="pair tall">
      <span>${t("calibrate.picture.field")}</span>
      <select
        data-testid="field"
        value=${doc.value.field ?? ""}
        onChange=${(/** @type {any} */ e) => chooseField(e.target.value)}
      >
        <option value="" disabled>${t("calibrate.picture.choose-field")}</option>
        ${fields.value.map(
          ({ name, title }) => html`<option key=${name} value=${name}>
          ${title}
        </option>`,
        )}
      </select>
    </label>
    <label class="pair tall">
      <span>${t("calibrate.picture.region")}</span>
      <select
        data-testid="region"
        value=${doc.value.region ?? ""}
        disabled=${!f}
        onChange=${(/** @type {any} */ e) => changePlace({ region: e.target.value, rotate: null })}
      >
        <option value="" disabled>${t("calibrate.picture.choose-area")}</option>
        ${Object.keys(f?.regions ?? {}).map(
          (name) => html`<option key=${name} value=${name}>
          ${areaTitle(name)}
        </option>`,
        )}
      </select>
    </label>
    <${FieldDrawing} />
    <${Turn} />
    ${
      f &&
      html`<p class="reason">
      ${f.own ? t("calibrate.picture.lines-elsewhere") : t("calibrate.picture.another-field")}${" "}
      <a href=${addressOf(f.own ? "field-editor" : "new-field", { field: f.name })} data-testid="edit-field">
        ${f.own ? t("calibrate.picture.edit") : t("calibrate.picture.edit-copy")}
      </a>
    </p>`
    }
  </section>`;
}

/** The same where the field is settled: to choose another one, go back. */
export function FieldFold() {
  if (!field.value || !region.value) return null;
  const name = `${field.value.title}, ${areaName(region.value.name)}`;
  return html`<${Fold} id="field" title=${t("calibrate.picture.field")} value=${name}>
    <${FieldDrawing} />
  <//>`;
}

function Turn() {
  const r = region.value;
  return html`<div class="line">
    <small>
      ${
        r &&
        html`
        ${number(across(r), 0)} × ${number(down(r), 0)} mm
        <br />
        ${t("calibrate.picture.turned", { degrees: rotation.value })}
      `
      }
    </small>
    <${ActionButton} id="turn" />
  </div>`;
}

/** @param {import("../../../core/types").Region} r */
const isTurned = (r) => (rotation.value - r.rotate) % 180 !== 0;
/** @param {import("../../../core/types").Region} r */
const across = (r) => (isTurned(r) ? r.height_mm : r.width_mm);
/** @param {import("../../../core/types").Region} r */
const down = (r) => (isTurned(r) ? r.width_mm : r.height_mm);

/** @param {string} name */
function chooseField(name) {
  const next = fields.value.find((f) => f.name === name);
  if (!next) return;
  const regions = Object.keys(next.regions),
    same = doc.value.region && regions.includes(doc.value.region);
  changePlace({
    observations: onField(doc.value.observations, next),
    field: name,
    region: same ? doc.value.region : (regions[0] ?? null),
    rotate: null,
  });
}

/** What decides whether an image will do. */
export const PictureAdvice = () =>
  html`<${List} title=${t("calibrate.picture.advice")} texts=${ADVICE} />`;

/** What to check of the chosen field; while none is, of the image. */
export const PictureHelp = () => html`
  ${region.value ? html`<${List} title=${t("calibrate.picture.check")} texts=${CHECKS} />` : html`<${PictureAdvice} />`}
  <div class="line">
    <${ActionButton} id="take" />
    <${ActionButton} id="open" />
  </div>
`;

/** @param {{ title: string, texts: string[] }} props */
const List = ({ title, texts }) => html`<section>
  <h2>${title}</h2>
  <ul class="plain">
    ${texts.map((text) => html`<li key=${text}>${text}</li>`)}
  </ul>
</section>`;
