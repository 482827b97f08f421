// The tab Live of a camera: its picture, its status and its controls.
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { nameOr, t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { Typed } from "../../../ui/typed.js";
import { backgroundProgress } from "../../calibrate/pictures.js";
import { BlinkLegend, GridLegend } from "../../compare/panels/legends.js";
import {
  cameraView,
  confirmCamera,
  controls,
  openedCamera,
  setControl,
  status,
} from "../camera_page.js";
import { STATES, VIEW_PX } from "../camera_status.js";
import { LiveCompare } from "../layers/live_compare.js";
import { LiveView } from "../layers/live_view.js";
import { isTwofold, liveRecord } from "../live_compare.js";

/** @typedef {import("../../../core/types").Control} Control */

/** @type {[import("../../../core/types").CompareMode, string][]} */
const VIEWS = [
  ["raw", t("common.raw")],
  ["wipe", t("live.view.wipe")],
  ["corrected", t("common.corrected")],
  ["side", t("live.view.side")],
  ["blink", t("common.blink")],
];

export function CameraPage() {
  const it = openedCamera.value,
    { view, lines } = cameraView.value;
  if (!it) return null;
  const can = status.value?.calibration_applied ?? false;
  return html`<div class="page" data-testid="live-desk">
    <h1>${it.name}</h1>
    <div class="line wrap">
      <div class="switch" role="group" aria-label=${t("live.show")}>
        ${VIEWS.map(
          ([id, label]) => html`<button
          key=${id}
          type="button"
          data-testid=${`look-${id}`}
          aria-pressed=${String(view === id)}
          disabled=${id !== "raw" && !can}
          title=${id !== "raw" && !can ? t("live.calibration-first") : label}
          onClick=${() => {
            cameraView.value = { ...cameraView.value, view: id };
          }}
        >
          ${label}
        </button>`,
        )}
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
        ${t("live.field-lines")}
      </button>
      ${
        liveRecord.value &&
        html`
        <${ActionButton} id="grid" />
        <${ActionButton} id="zoom-out" />
        <${ActionButton} id="zoom-in" />
        <${ActionButton} id="zoom-fit" />
      `
      }
    </div>
    ${
      isTwofold.value
        ? html`<${LiveCompare} key=${`both-${it.id}`} id=${it.id} name=${it.name}>
        <${BlinkLegend} />
        <${GridLegend} />
      <//>`
        : html`<${LiveView}
        key=${it.id}
        id=${it.id}
        name=${it.name}
        view=${can ? /** @type {"raw" | "corrected"} */ (view) : "raw"}
        width=${VIEW_PX}
        lines=${lines}
      />`
    }
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
  backgroundProgress.value &&
  html`<div class="working" data-testid="watching">
    <div class="line">
      <progress max="1" value=${backgroundProgress.value.share} aria-label=${t("live.watching")}></progress>
      <${ActionButton} id="stop-watching" />
    </div>
    <p class="reason">${t("live.watching.why")}</p>
  </div>`;

/** The left side: how the camera is. */
export function CameraPanel() {
  const it = status.value;
  if (!it) return null;
  return html`
    <section aria-label=${t("live.status")}>
      <${Title} of="live">${t("live.status")}<//>
      <dl class="details" data-testid="camera-details">
        <div>
          <dt>${t("live.status.state")}</dt>
          <dd>${STATES[it.state]}</dd>
        </div>
        <div>
          <dt>${t("live.status.frames")}</dt>
          <dd>${t("live.status.frame-rate", { rate: number(it.fps) })}</dd>
        </div>
        <div>
          <dt>${t("live.status.size")}</dt>
          <dd>${it.width ? `${it.width} × ${it.height} px` : "–"}</dd>
        </div>
        <div>
          <dt>${t("live.status.newest")}</dt>
          <dd>
            ${
              it.frame_age_s === null
                ? t("live.status.newest.none")
                : it.frame_age_s < 1
                  ? t("live.status.newest.now")
                  : t("live.status.newest.ago", { age: number(it.frame_age_s, 0) })
            }
          </dd>
        </div>
        <div>
          <dt>${t("live.status.came-back")}</dt>
          <dd>
            ${t("live.status.reconnects", { count: it.reconnects })}
          </dd>
        </div>
        ${Object.entries(it.identity ?? {})
          .filter(([, value]) => value)
          .map(
            ([name, value]) => html`<div key=${name}>
            <dt>${identityTitle(name)}</dt>
            <dd class="breaks">${value}</dd>
          </div>`,
          )}
      </dl>
      ${
        it.problem &&
        html`<div class="warning-line" role="status" data-testid="camera-problem">
        <b>${it.problem.what}</b> ${it.problem.fix}
        ${
          it.problem.reason === "other-camera" &&
          html`<div class="line">
          <button type="button" data-testid="confirm" onClick=${() => void confirmCamera()}>
            ${t("live.same-camera")}
          </button>
        </div>`
        }
      </div>`
      }
    </section>
    <${Look} />
  `;
}

/** @param {string} name */
const identityTitle = (name) => nameOr(`live.identity.${name}`, name);

/** Light and focus, in words first. */
function Look() {
  const it = status.value;
  if (!it || it.state !== "live") return null;
  return html`<section aria-label=${t("live.light")} data-testid="look">
    <${Title} of="light">${t("live.light")}<//>
    ${
      it.words.length
        ? html`<ul class="warnings">
        ${it.words.map(
          (w) => html`<li key=${w.text} data-severity=${w.severity}>
          <b>${w.text}</b> ${w.fix}
        </li>`,
        )}
      </ul>`
        : html`<p class="reason">${t("live.light.fine")}</p>`
    }
    ${
      it.light &&
      html`<dl class="details">
      <div>
        <dt>${t("live.light.brightness")}</dt>
        <dd>${t("live.light.of-255", { mean: number(it.light.mean, 0) })}</dd>
      </div>
      <div>
        <dt>${t("live.light.too-dark")}</dt>
        <dd>${number(100 * it.light.clipped_low)} %</dd>
      </div>
      <div>
        <dt>${t("live.light.burnt-out")}</dt>
        <dd>${number(100 * it.light.clipped_high)} %</dd>
      </div>
      <div>
        <dt>${t("live.light.evenness")}</dt>
        <dd>${it.light.evenness === null ? "–" : `${number(100 * it.light.evenness, 0)} %`}</dd>
      </div>
    </dl>`
    }
  </section>`;
}

/** The right side: what can be set on the camera. */
export function CameraReport() {
  const at = controls.value;
  if (!at?.items.length)
    return html`<section>
      <${Title} of="controls">${t("live.controls")}<//>
      <p class="reason">${t("live.controls.none")}</p>
    </section>`;
  return html`
    <section aria-label=${t("live.controls.of-camera")}>
      <${Title} of="controls">${t("live.controls")}<//>
      ${at.items.map((c) => html`<${Setting} key=${c.name} control=${c} />`)}
      <p class="reason">
        ${t("live.controls.one-size")}
      </p>
    </section>
  `;
}

/** A control that every kind of camera has is named here, another by its camera. @param {Control} control */
const controlTitle = ({ name, label }) =>
  nameOr(`live.control.${name.replaceAll("_", "-")}`, label);

/** @param {{ control: Control }} props */
function Setting({ control }) {
  const { name, kind, value, unit, range, choices, automatic } = control,
    label = controlTitle(control);
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
    ${
      automatic !== null &&
      html`<label class="line">
      <input
        type="checkbox"
        checked=${isAuto}
        onChange=${(/** @type {any} */ e) => set(e.target.checked ? "auto" : value)}
      />${" "}
      ${t("live.controls.automatic")}
    </label>`
    }
    ${
      range &&
      html`<p class="reason">
      ${t("live.controls.range", { least: number(range[0], 1), most: number(range[1], 1), unit })}
    </p>`
    }
  </div>`;
}
