// The page of one camera: its picture live, its status and controls; and the form for a new one.
import { useEffect } from "preact/hooks";
import { number, words } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { fields, namedCamera } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { Typed } from "../../../ui/typed.js";
import { backgroundProgress } from "../../calibrate/pictures.js";
import { BlinkLegend, GridLegend } from "../../compare/panels/legends.js";
import {
  cameraView,
  closeForm,
  confirmCamera,
  controls,
  discoverCameras,
  discoveredCameras,
  form,
  openedCamera,
  refusal,
  removeCamera,
  setControl,
  setFormValue,
  sourceKinds,
  sourceTest,
  status,
  testedSource,
} from "../camera_page.js";
import { STATES, followCameras } from "../camera_status.js";
import { LiveCompare } from "../layers/live_compare.js";
import { LiveView } from "../layers/live_view.js";
import { liveRecord } from "../live_compare.js";

/** @typedef {import("../../../core/types").Control} Control */

const WIDTH = 960;
/** @type {[import("../../../core/types").CompareMode, string][]} */
const VIEWS = [
  ["raw", "Raw"],
  ["wipe", "Wipe"],
  ["corrected", "Corrected"],
  ["side", "Side by side"],
  ["blink", "Blink"],
];

export function CameraPage() {
  const it = openedCamera.value,
    { view, lines } = cameraView.value;
  useEffect(() => (it ? followCameras([it.id]) : undefined), [it?.id]);
  if (!it) return null;
  const can = status.value?.calibration_applied ?? false;
  return html`<div class="page" data-testid="live-desk">
    <h1>${it.name}</h1>
    <div class="line wrap">
      <div class="switch" role="group" aria-label="Show">
        ${VIEWS.map(([id, label]) => html`<button
          key=${id}
          type="button"
          data-testid=${`look-${id}`}
          aria-pressed=${String(view === id)}
          disabled=${id !== "raw" && !can}
          title=${id !== "raw" && !can ? "Activate a calibration for this camera first." : label}
          onClick=${() => {
            cameraView.value = { ...cameraView.value, view: id };
          }}
        >
          ${label}
        </button>`)}
      </div>
      <button
        type="button"
        data-testid="look-lines"
        aria-pressed=${String(lines)}
        disabled=${!can}
        onClick=${() => {
          cameraView.value = { ...cameraView.value, lines: !lines };
        }}
      >
        Field lines
      </button>
      ${liveRecord.value && html`
        <${ActionButton} id="grid" />
        <${ActionButton} id="zoom-out" />
        <${ActionButton} id="zoom-in" />
        <${ActionButton} id="zoom-fit" />
      `}
    </div>
    ${can && view !== "raw" && view !== "corrected"
      ? html`<${LiveCompare} key=${`both-${it.id}`} id=${it.id} name=${it.name}>
        <${BlinkLegend} />
        <${GridLegend} />
      <//>`
      : html`<${LiveView}
        key=${it.id}
        id=${it.id}
        name=${it.name}
        view=${can ? /** @type {"raw" | "corrected"} */ (view) : "raw"}
        width=${WIDTH}
        lines=${lines}
      />`}
    <${Watching} />
    <div class="line wrap">
      <${ActionButton} id="take-live" />
      <${ActionButton} id="take-still" />
      <${ActionButton} id="watch-board" />
      <${ActionButton} id="watch-rolls" />
    </div>
  </div>`;
}

/** How far the watching of many frames is. */
export const Watching = () =>
  backgroundProgress.value && html`<div class="working" data-testid="watching">
    <div class="line">
      <progress max="1" value=${backgroundProgress.value.share} aria-label="Watching"></progress>
      <${ActionButton} id="stop-watching" />
    </div>
    <p class="reason">Watching for eight seconds, so that whoever walks by leaves the picture.</p>
  </div>`;

/** The left side: how the camera is. */
export function CameraPanel() {
  const it = status.value;
  if (!it) return null;
  return html`
    <section aria-label="State">
      <${Title} of="live">State<//>
      <dl class="details" data-testid="camera-details">
        <div>
          <dt>state</dt>
          <dd>${STATES[it.state]}</dd>
        </div>
        <div>
          <dt>frames</dt>
          <dd>${number(it.fps)} per s</dd>
        </div>
        <div>
          <dt>size</dt>
          <dd>${it.width ? `${it.width} × ${it.height} px` : "–"}</dd>
        </div>
        <div>
          <dt>newest picture</dt>
          <dd>
            ${it.frame_age_s === null
              ? "none yet"
              : it.frame_age_s < 1
                ? "now"
                : `${number(it.frame_age_s, 0)} s ago`}
          </dd>
        </div>
        <div>
          <dt>came back</dt>
          <dd>
            ${it.reconnects} ${it.reconnects === 1 ? "time" : "times"}
          </dd>
        </div>
        ${Object.entries(it.identity ?? {})
          .filter(([, value]) => value)
          .map(([name, value]) => html`<div key=${name}>
            <dt>${name}</dt>
            <dd class="breaks">${value}</dd>
          </div>`)}
      </dl>
      ${it.problem && html`<div class="warning-line" role="status" data-testid="camera-problem">
        <b>${it.problem.what}</b> ${it.problem.fix}
        ${it.problem.reason === "other-camera" && html`<div class="line">
          <button type="button" data-testid="confirm" onClick=${() => void confirmCamera()}>
            It is the same camera
          </button>
        </div>`}
      </div>`}
    </section>
    <${Look} />
  `;
}

/** Light and focus, in words first. */
function Look() {
  const it = status.value;
  if (!it || it.state !== "live") return null;
  return html`<section aria-label="Light and focus" data-testid="look">
    <${Title} of="light">Light and focus<//>
    ${it.words.length
      ? html`<ul class="warnings">
        ${it.words.map((w) => html`<li key=${w.text} data-severity=${w.severity}>
          <b>${w.text}</b> ${w.fix}
        </li>`)}
      </ul>`
      : html`<p class="reason">Nothing to complain about.</p>`}
    ${it.light && html`<dl class="details">
      <div>
        <dt>mean brightness</dt>
        <dd>${number(it.light.mean, 0)} of 255</dd>
      </div>
      <div>
        <dt>too dark</dt>
        <dd>${number(100 * it.light.clipped_low)} %</dd>
      </div>
      <div>
        <dt>burnt out</dt>
        <dd>${number(100 * it.light.clipped_high)} %</dd>
      </div>
      <div>
        <dt>evenness</dt>
        <dd>${it.light.evenness === null ? "–" : `${number(100 * it.light.evenness, 0)} %`}</dd>
      </div>
    </dl>`}
  </section>`;
}

/** The right side: what can be set on the camera. */
export function CameraReport() {
  const at = controls.value;
  if (!at?.items.length)
    return html`<section>
      <${Title} of="controls">Settings<//>
      <p class="reason">This source has nothing that can be set while it runs.</p>
    </section>`;
  return html`
    <section aria-label="Camera settings">
      <${Title} of="controls">Settings<//>
      ${at.items.map((c) => html`<${Setting} key=${c.name} control=${c} />`)}
      <p class="reason">
        As the camera says they are. A calibration holds for one size: setting another leaves it without.
      </p>
    </section>
  `;
}

/** @param {{ control: Control }} props */
function Setting({ control: { name, label, kind, value, unit, range, choices, automatic } }) {
  const set = (/** @type {unknown} */ to) => setControl(name, to),
    isAuto = automatic === true;
  const field =
    kind === "bool"
      ? html`<input
        type="checkbox"
        data-testid=${`set-${name}`}
        aria-label=${label}
        checked=${value === true}
        onChange=${(/** @type {any} */ e) => set(e.target.checked)}
      />`
      : kind === "choice"
      ? html`<select
        data-testid=${`set-${name}`}
        aria-label=${label}
        value=${value}
        disabled=${isAuto}
        onChange=${(/** @type {any} */ e) => set(e.target.value)}
      >
        ${choices.map((c) => html`<option key=${c}>${c}</option>`)}
      </select>`
      : html`<span class="with-unit">
        <${Typed}
          type="number"
          data-testid=${`set-${name}`}
          aria-label=${label}
          step="any"
          min=${range?.[0]}
          max=${range?.[1]}
          value=${value}
          disabled=${isAuto}
          take=${(/** @type {string} */ text) => set(Number(text))}
        />
        <em>${unit}</em>
      </span>`;
  return html`<div class="option">
    <div class="pair">
      <span>${label}</span>
      ${field}
    </div>
    ${automatic !== null && html`<label class="line">
      <input
        type="checkbox"
        checked=${isAuto}
        onChange=${(/** @type {any} */ e) => set(e.target.checked ? "auto" : value)}
      />${" "}
      the camera sets it
    </label>`}
    ${range && html`<p class="reason">
      ${number(range[0], 1)} to ${number(range[1], 1)} ${unit}
    </p>`}
  </div>`;
}

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
