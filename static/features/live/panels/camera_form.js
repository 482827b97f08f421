// The form of a camera, new or changed: where its pictures come from, what was tried, and what is plugged in.
import { areaTitle, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { fields, namedCamera } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { LiveView } from "../layers/live_view.js";
import {
  closeForm,
  discoverCameras,
  discoveredCameras,
  form,
  refusal,
  removeCamera,
  setFormValue,
  sourceKinds,
  sourceTest,
  testedSource,
} from "../camera_page.js";

const PICTURE_PX = 640,
  PICTURE_FPS = 4; // enough to see which camera it is

export function CameraForm() {
  const it = form.value,
    camera = namedCamera.value;
  if (camera && !camera.editable) return html`<${ReadOnly} camera=${camera} />`;
  if (!it) return null;
  const { values, etag } = it,
    at = fields.value.find((f) => f.name === values.field);
  const text = (/** @type {any} */ e) => e.target.value;
  return html`<form
    class="page"
    data-testid="camera-form"
    onSubmit=${(/** @type {Event} */ e) => e.preventDefault()}
  >
    <h1>${etag ? t("live.form.change", { camera: values.name }) : t("live.form.add")}</h1>
    <p class="dim">${t("live.form.intro")}</p>
    <label class="pair tall">
      <span>${t("live.form.source")}</span>
      <input
        type="text"
        data-testid="camera-source"
        spellcheck="false"
        autocomplete="off"
        placeholder="rtsp://10.0.0.5/live"
        value=${values.source}
        onInput=${(/** @type {any} */ e) => setFormValue({ source: text(e).trim() })}
      />
    </label>
    <label class="pair tall">
      <span>${t("live.form.id")}</span>
      <input
        type="text"
        data-testid="camera-id"
        pattern="[A-Za-z0-9][A-Za-z0-9_-]*"
        disabled=${etag !== ""}
        value=${values.id}
        onInput=${(/** @type {any} */ e) => setFormValue({ id: text(e).trim() })}
      />
    </label>
    <label class="pair tall">
      <span>${t("live.form.name")}</span>
      <input
        type="text"
        data-testid="camera-name"
        value=${values.name}
        onInput=${(/** @type {any} */ e) => setFormValue({ name: text(e) })}
      />
    </label>
    <label class="pair tall">
      <span>${t("live.form.field")}</span>
      <select
        data-testid="camera-field"
        value=${values.field ?? ""}
        onChange=${(/** @type {any} */ e) => setFormValue({ field: text(e) || null, region: null })}
      >
        <option value="">${t("live.form.not-said")}</option>
        ${fields.value.map(
          (f) => html`<option key=${f.name} value=${f.name}>
          ${f.title}
        </option>`,
        )}
      </select>
    </label>
    ${
      at &&
      html`<label class="pair tall">
      <span>${t("live.form.region")}</span>
      <select
        data-testid="camera-region"
        value=${values.region ?? ""}
        onChange=${(/** @type {any} */ e) => setFormValue({ region: text(e) || null })}
      >
        <option value="">${t("live.form.not-said")}</option>
        ${Object.keys(at.regions).map(
          (name) => html`<option key=${name} value=${name}>
          ${areaTitle(name)}
        </option>`,
        )}
      </select>
    </label>`
    }
    ${
      sourceTest.value &&
      html`<div class="working">
      <div class="line">
        <progress aria-label=${t("live.form.trying")}></progress>
        <button type="button" onClick=${() => sourceTest.value?.abort()}>
          ${t("common.stop")}
        </button>
      </div>
      <p class="reason">${t("live.form.opening")}</p>
    </div>`
    }
    ${
      refusal.value &&
      html`<div class="warning-line" role="alert" data-testid="camera-refusal">
      <b>${refusal.value.detail}</b> ${refusal.value.fix}
    </div>`
    }
    <div class="line wrap">
      <${ActionButton} id="try-camera" />
      <${ActionButton} id="keep-camera" />
      <button type="button" data-testid="close-form" onClick=${closeForm}>
        ${t("common.cancel")}
      </button>
      ${
        camera &&
        html`<button type="button" data-testid="remove-camera" onClick=${() => void removeCamera(camera)}>
        ${t("live.form.remove")}
      </button>`
      }
    </div>
  </form>`;
}

/** A camera of the settings file: how it is set, and what it sees.
 * @param {{ camera: import("../../../core/types").Camera }} props */
function ReadOnly({ camera: { id, name, source, field, region } }) {
  const rows = [
    [t("live.form.source"), source],
    [t("live.form.id"), id],
    [t("live.form.field"), fields.value.find((f) => f.name === field)?.title ?? field],
    [t("live.form.region"), region && areaTitle(region)],
  ];
  return html`<div class="page" data-testid="camera-settings">
    <h1>${name}</h1>
    <p class="dim">${t("live.form.in-settings-file")}</p>
    <dl class="details">
      ${rows.map(
        ([label, value]) => html`<div key=${label}>
        <dt>${label}</dt>
        <dd class="breaks">${value || t("live.form.not-said")}</dd>
      </div>`,
      )}
    </dl>
    <${LiveView} id=${id} name=${name} width=${PICTURE_PX} fps=${PICTURE_FPS} />
  </div>`;
}

/** What the source showed. */
export function Tried() {
  const it = testedSource.value;
  if (!it || it.source !== form.value?.values.source)
    return html`<section>
      <h2>${t("live.form.picture")}</h2>
      <p class="reason">${t("live.form.try-first")}</p>
    </section>`;
  return html`<section aria-label=${t("live.form.picture")}>
    <h2>${t("live.form.picture")}</h2>
    <img class="tried" data-testid="tried" alt=${t("live.form.shown")} src=${it.picture} />
    <p class="reason">
      ${t("live.form.format", { width: it.width, height: it.height, rate: number(it.fps) })}
    </p>
  </section>`;
}

export function SourceHelp() {
  return html`
    <section aria-label=${t("live.plugged")}>
      <h2>${t("live.plugged")}</h2>
      ${
        discoveredCameras.value === null
          ? html`<p class="reason">${t("live.plugged.looking")}</p>`
          : discoveredCameras.value.length
            ? html`<ul class="plain" data-testid="plugged">
          ${discoveredCameras.value.map(
            (p) => html`<li key=${p.address}>
            <button type="button" class="plain-link" onClick=${() => setFormValue({ source: p.address })}>
              ${p.title}
            </button>
          </li>`,
          )}
        </ul>`
            : html`<p class="reason" data-testid="plugged">
          ${t("live.plugged.none")}
        </p>`
      }
      <button
        type="button"
        disabled=${discoveredCameras.value === null}
        onClick=${() => void discoverCameras()}
      >
        ${t("live.plugged.look-again")}
      </button>
    </section>
    <section>
      <${Title} of="controls">${t("live.source-kinds")}<//>
      <dl class="details kinds">
        ${sourceKinds.value.map(
          (k) => html`<div key=${k.scheme}>
          <dt>
            <button
              type="button"
              class="plain-link"
              onClick=${() => setFormValue({ source: `${k.scheme}://` })}
            >
              ${k.scheme}://
            </button>
          </dt>
          <dd class="breaks" title=${k.help}>
            ${k.title}
          </dd>
        </div>`,
        )}
      </dl>
    </section>
  `;
}
