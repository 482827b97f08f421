// Which field the picture shows, which part of it, and how it stands.
import { change, doc } from "../../../core/document.js";
import { number, words } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { field, fields, region, rotation } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { onField } from "../editing.js";
import { rememberField } from "../pictures.js";
import { FieldDrawing } from "./field_drawing.js";

export function FieldPanel() {
  const f = field.value;
  return html`<section aria-label="Field">
    <${Title} of="field">Field<//>
    <label class="pair tall">
      <span>Field</span>
      <select
        data-testid="field"
        value=${doc.value.field}
        onChange=${(/** @type {any} */ e) => chooseField(e.target.value)}
      >
        ${fields.value.map(({ name, title }) => html`<option key=${name} value=${name}>
          ${title}
        </option>`)}
      </select>
    </label>
    <label class="pair tall">
      <span>Part in view</span>
      <select
        data-testid="region"
        value=${doc.value.region}
        onChange=${(/** @type {any} */ e) => change({ ...doc.value, region: e.target.value, rotate: null })}
      >
        ${Object.keys(f?.regions ?? {}).map((name) => html`<option key=${name} value=${name}>
          ${words(name)}
        </option>`)}
      </select>
    </label>
    <${FieldDrawing} />
    <${Turn} />
    ${f && html`<p class="reason">
      ${f.own ? "Lines lie elsewhere?" : "Another field?"}${" "}
      <a href=${addressOf(f.own ? "field-editor" : "new-field", { field: f.name })} data-testid="edit-field">
        ${f.own ? "Edit this field" : "Edit a copy of this one"}
      </a>
    </p>`}
  </section>`;
}

/** The same in the steps where the field is settled: to choose another one, go back. */
export function FieldSummary() {
  return html`<section aria-label="Field">
    <h2>
      ${field.value?.title}, ${words(region.value?.name ?? "").toLowerCase()}
    </h2>
    <${FieldDrawing} />
  </section>`;
}

function Turn() {
  const r = region.value;
  return html`<div class="line">
    <small>
      ${r && html`
        ${number(across(r), 0)} × ${number(down(r), 0)} mm
        <br />
        turned ${rotation.value}°
      `}
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
  rememberField(name);
  change({
    ...doc.value,
    observations: onField(doc.value.observations, next),
    field: name,
    region: same ? doc.value.region : (regions[0] ?? null),
    rotate: null,
  });
}

/** What decides whether a picture will do. */
export function PictureAdvice() {
  return html`<section>
    <h2>A good picture</h2>
    <ul class="plain">
      <li>From the camera as it hangs during the match: any later knock makes the calibration wrong.</li>
      <li>The whole part of the field that the camera is responsible for, with all four borders.</li>
      <li>Sharp and evenly lit; lines bright but not burnt out. Robots may stand on it.</li>
      <li>At the size that your vision program uses.</li>
    </ul>
  </section>`;
}

export function PictureHelp() {
  return html`<section>
    <h2>What to check</h2>
    <ul class="plain">
      <li>The drawing on the left stands as the field stands in the picture: turn it if not.</li>
      <li>All four coloured borders are in the picture; hidden stretches do not matter.</li>
      <li>You will click the borders of this part, not those of the whole field.</li>
    </ul>
    <div class="line">
      <${ActionButton} id="take" />
      <${ActionButton} id="open" />
    </div>
  </section>`;
}
