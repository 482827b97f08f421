// The form of a camera, new or changed: where its pictures come from, what was tried, and what is plugged in.
import { number, words } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { fields, namedCamera } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
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

export function CameraForm() {
  const it = form.value,
    camera = namedCamera.value;
  if (camera && !camera.editable)
    return html`<div class="page">
      <h1>${camera.name}</h1>
      <p class="dim">This camera is listed in the settings file, so it is changed there: ${camera.source}</p>
    </div>`;
  if (!it) return null;
  const { values, etag } = it,
    at = fields.value.find((f) => f.name === values.field);
  const text = (/** @type {any} */ e) => e.target.value;
  return html`<form
    class="page"
    data-testid="camera-form"
    onSubmit=${(/** @type {Event} */ e) => e.preventDefault()}
  >
    <h1>${etag ? `Change ${values.name}` : "Add a camera"}</h1>
    <p class="dim">Say where its pictures come from and try it. Nothing is kept before you do.</p>
    <label class="pair tall">
      <span>Where its pictures come from</span>
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
      <span>Short name, for addresses: letters, digits, - and _</span>
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
      <span>Name</span>
      <input
        type="text"
        data-testid="camera-name"
        value=${values.name}
        onInput=${(/** @type {any} */ e) => setFormValue({ name: text(e) })}
      />
    </label>
    <label class="pair tall">
      <span>Field</span>
      <select
        data-testid="camera-field"
        value=${values.field ?? ""}
        onChange=${(/** @type {any} */ e) => setFormValue({ field: text(e) || null, region: null })}
      >
        <option value="">Not said</option>
        ${fields.value.map((f) => html`<option key=${f.name} value=${f.name}>
          ${f.title}
        </option>`)}
      </select>
    </label>
    ${at && html`<label class="pair tall">
      <span>Part in view</span>
      <select
        data-testid="camera-region"
        value=${values.region ?? ""}
        onChange=${(/** @type {any} */ e) => setFormValue({ region: text(e) || null })}
      >
        <option value="">Not said</option>
        ${Object.keys(at.regions).map((name) => html`<option key=${name} value=${name}>
          ${words(name)}
        </option>`)}
      </select>
    </label>`}
    ${sourceTest.value && html`<div class="working">
      <div class="line">
        <progress aria-label="Trying the source"></progress>
        <button type="button" onClick=${() => sourceTest.value?.abort()}>
          Stop
        </button>
      </div>
      <p class="reason">Opening it, and waiting for a picture: up to 15 s.</p>
    </div>`}
    ${refusal.value && html`<div class="warning-line" role="alert" data-testid="camera-refusal">
      <b>${refusal.value.detail}</b> ${refusal.value.fix}
    </div>`}
    <div class="line wrap">
      <${ActionButton} id="try-camera" />
      <${ActionButton} id="keep-camera" />
      <button type="button" data-testid="close-form" onClick=${closeForm}>
        Cancel
      </button>
      ${camera && html`<button type="button" data-testid="remove-camera" onClick=${() => void removeCamera(camera)}>
        Remove this camera
      </button>`}
    </div>
  </form>`;
}

/** What the source showed. */
export function Tried() {
  const it = testedSource.value;
  if (!it || it.source !== form.value?.values.source)
    return html`<section>
      <h2>Its picture</h2>
      <p class="reason">Try it to see what it gives.</p>
    </section>`;
  return html`<section aria-label="Its picture">
    <h2>Its picture</h2>
    <img class="tried" data-testid="tried" alt="What the source shows" src=${it.picture} />
    <p class="reason">
      ${it.width} × ${it.height} px, ${number(it.fps)} frames a second.
    </p>
  </section>`;
}

export function SourceHelp() {
  return html`
    <section aria-label="Plugged in">
      <h2>Plugged in</h2>
      ${discoveredCameras.value === null
        ? html`<p class="reason">Looking…</p>`
        : discoveredCameras.value.length
        ? html`<ul class="plain" data-testid="plugged">
          ${discoveredCameras.value.map((p) => html`<li key=${p.address}>
            <button type="button" class="plain-link" onClick=${() => setFormValue({ source: p.address })}>
              ${p.title}
            </button>
          </li>`)}
        </ul>`
        : html`<p class="reason" data-testid="plugged">
          No camera shows itself. Network cameras do not: give their address.
        </p>`}
      <button
        type="button"
        disabled=${discoveredCameras.value === null}
        onClick=${() => void discoverCameras()}
      >
        Look again
      </button>
    </section>
    <section>
      <${Title} of="controls">Kinds of source<//>
      <dl class="details kinds">
        ${sourceKinds.value.map((k) => html`<div key=${k.scheme}>
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
        </div>`)}
      </dl>
    </section>
  `;
}
