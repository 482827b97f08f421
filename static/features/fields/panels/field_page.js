// The place Field: each field that is used, with the cameras above it and how well they agree; then all others.
import { address } from "../../../core/api.js";
import { areaName, mm, number, shortened } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { cameras, fields } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { FieldAreas, Markings, frameOf, placeIn } from "../../../ui/field_plan.js";
import { rich } from "../../../ui/rich.js";
import { Accuracy } from "../../live/panels/wall.js";
import { rigs } from "../../rigs/rig.js";
import { Outdated } from "../../versions/panels/outdated.js";
import { openFieldFile } from "../editor.js";

/**
 * @typedef {import("../../../core/types").Field} Field
 * @typedef {import("../../../core/types").Camera} Camera
 * @typedef {import("../../rigs/types").Rig} Rig
 */

const NAME_CHARACTERS = 20,
  SKETCH_EDGE = 0.04; // of its length: so much carpet is around the markings

/** @param {string} name of a field */
const camerasOver = (name) => cameras.value.filter((c) => (c.active?.field ?? c.field) === name);
/** @param {Camera} camera */
const areaOf = ({ region, active }) => active?.region ?? region ?? "";
/** @param {string} name of a field */
const rigsOver = (name) => rigs.value.filter((r) => r.field === name);

export function FieldPage() {
  const isUsed = (/** @type {Field} */ { name }) =>
    camerasOver(name).length > 0 || rigsOver(name).length > 0;
  const rest = fields.value.filter((f) => !isUsed(f));
  return html`<div class="page" data-testid="field-page">
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
          accept=".json,.pb,.xml,.yml,.yaml"
          onChange=${(/** @type {{ target: HTMLInputElement }} */ { target }) => {
            const file = target.files?.[0];
            if (file) void openFieldFile(file);
            target.value = "";
          }}
        />
      </label>
      <${ActionButton} id="new-rig" />
    </div>
    ${fields.value.filter(isUsed).map((f) => html`<${UsedField} key=${f.name} it=${f} />`)}
    <${Cards}
      title=${t("field-editor.list.yours")}
      some=${rest.filter((f) => f.own)}
    />
    <${Cards}
      title=${t("field-editor.list.shipped")}
      some=${rest.filter((f) => !f.own)}
    />
  </div>`;
}

/** A field with the cameras above it, and the rigs that they form. @param {{ it: Field }} props */
function UsedField({ it }) {
  const { name, title, own } = it,
    over = camerasOver(name);
  return html`<section
    class="used-field"
    aria-label=${title}
    data-testid=${`field-card-${name}`}
  >
    <a href=${addressOf("field-editor", { field: name })} data-testid=${`edit-field-${name}`}>
      <${Covered} it=${it} over=${over} />
      <b>${title}</b>
    </a>
    <div>
      <${Links} it=${it} />
      ${own && html`<${Outdated} field=${name} />`}
      <h2>${t("shell.place.cameras")}</h2>
      <ul class="plain over-field">
        ${over.map(
          (camera) => html`<li key=${camera.id}>
          <a href=${addressOf("live", { camera: camera.id })} data-testid=${`over-${camera.id}`}>${camera.name}</a>
          <small>${areaOf(camera) && areaName(areaOf(camera))}</small>
          <${Accuracy} id=${camera.id} active=${camera.active} />
        </li>`,
        )}
      </ul>
      <h2>${t("field-editor.agreement")}</h2>
      <${Agreement} field=${name} count=${over.length} />
    </div>
  </section>`;
}

/** Each rig above a field with what its newest check has found; how to come by one.
 * @param {{ field: string, count: number }} props */
function Agreement({ field, count }) {
  const some = rigsOver(field);
  if (!some.length)
    return html`<p class="dim">
      ${count < 2 ? t("field-editor.agreement.one") : t("field-editor.agreement.none")}${" "}
      ${
        count > 1 &&
        html`<a href=${addressOf("new-rig", { field })} data-testid=${`rig-over-${field}`}>
        ${t("rig.action.new.short")}
      </a>`
      }
    </p>`;
  return html`<ul class="plain over-field">
    ${some.map(
      (r) => html`<li key=${r.name}>
      <a href=${addressOf("rig", { rig: r.name })} data-testid=${`rig-${r.name}`}>${r.title || r.name}</a>
      <small>${r.cameras.map((c) => c.title).join(t("rig.and"))}</small>
      <${Checked} rig=${r} />
    </li>`,
    )}
  </ul>`;
}

/** @param {{ rig: Rig }} props */
function Checked({ rig: { checked } }) {
  if (!checked) return html`<span class="dim">${t("field-editor.agreement.unchecked")}</span>`;
  const { verdict, p95_mm: p95, outdated } = checked;
  return html`<span class=${`level ${verdict.level ?? "unknown"}`} title=${outdated[0]?.text ?? verdict.sentence}>
    <b>${p95 === null || verdict.level === null ? "?" : mm(p95)}</b> mm
  </span>`;
}

/** @param {{ title: string, some: Field[] }} props */
const Cards = ({ title, some }) =>
  some.length > 0 &&
  html`<section aria-label=${title}>
    <h2>${title}</h2>
    <ul class="field-cards">
      ${some.map(
        (it) => html`<li key=${it.name} class="card" data-testid=${`field-card-${it.name}`}>
        <a href=${addressOf("field-editor", { field: it.name })} data-testid=${`edit-field-${it.name}`}>
          <${Sketch} it=${it} />
          <b>${it.title}</b>
        </a>
        <${Links} it=${it} />
      </li>`,
      )}
    </ul>
  </section>`;

/** Its size, and what can be had of it. @param {{ it: Field }} props */
function Links({ it: { name, title, length_mm: length, width_mm: width } }) {
  const of = html`<span class="sr">${t("field-editor.card.of", { title })}</span>`;
  return html`<div class="line wrap">
    <small>${number(length, 0)} × ${number(width, 0)} mm</small>
    <a href=${addressOf("new-field", { field: name })} data-testid=${`copy-field-${name}`}>
      ${rich("field-editor.card.copy", { of })}
    </a>
    <a href=${address(`/fields/${name}/export/json`)} download>
      ${rich("field-editor.card.json", { of })}
    </a>
    <a href=${address(`/fields/${name}/export/ssl-vision`)} download>
      ${rich("field-editor.card.ssl-vision", { of })}
    </a>
    <a href=${address(`/fields/${name}/export/vision-processor`)} download>
      ${rich("field-editor.card.vision-processor", { of })}
    </a>
  </div>`;
}

/** Its markings. @param {{ it: Field }} props */
function Sketch({ it }) {
  const frame = frameOf(it, SKETCH_EDGE * it.length_mm);
  return html`<svg class="sketch" viewBox=${`0 0 ${frame.width} ${frame.height}`} aria-hidden="true">
    <${Markings} field=${it} place=${placeIn(frame)} />
  </svg>`;
}

/** Its markings, and the part that each camera covers with the camera's name.
 * @param {{ it: Field, over: Camera[] }} props */
const Covered = ({ it, over }) => html`<${FieldAreas}
  field=${it}
  label=${t("field-editor.covered", { field: it.title })}
  areas=${over.flatMap((camera) => {
    const { id, name, active } = camera,
      area = it.regions[areaOf(camera)],
      text = shortened(name, NAME_CHARACTERS);
    return area ? [{ key: id, area, level: active?.verdict.level, text }] : [];
  })}
/>`;
