// The 3-D scene: view options at the left, viser in the middle, figures at the right.
import { run } from "../../../core/actions.js";
import { address } from "../../../core/api.js";
import { dayAndTime, mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { go } from "../../../core/route.js";
import { cameras } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { MapScale } from "../../../ui/map_scale.js";
import { rich } from "../../../ui/rich.js";
import { Title } from "../../../ui/title.js";
import { reportAddress } from "../../report/address.js";
import { rigs } from "../../rigs/rig.js";
import {
  before,
  changeView,
  clicked,
  only,
  place,
  refusal,
  sceneView,
  showInPicture,
  showVersion,
  shownScene,
  toggleCamera,
  toggleLayer,
  versions,
  what,
} from "../scene.js";

/**
 * @typedef {import("../types").SceneCamera} SceneCamera
 * @typedef {{ target: HTMLInputElement & HTMLSelectElement }} Changed
 */

/** @type {[import("../types").Layer, string][]} */
const LAYERS = [
  ["pictures", t("scene.layer.pictures")],
  ["rays", t("scene.layer.rays")],
  ["arrows", t("scene.layer.arrows")],
  ["footprints", t("scene.layer.footprints")],
  ["labels", t("scene.layer.labels")],
  ["things", t("scene.layer.things")],
];
const LOG = 100; // steps of the slider in a power of ten

export function SceneForm() {
  const it = shownScene.value;
  return html`
    <${Which} />
    ${
      it &&
      !it.boards &&
      html`
      <section aria-label=${t("scene.views")}>
        <h2>${t("scene.views.title")}</h2>
        <div class="switch" role="group" aria-label=${t("scene.views.from-where")}>
          ${["scene-free", "scene-above"].map(
            (id) => html`<button
            key=${id}
            type="button"
            data-testid=${id}
            aria-pressed=${String(sceneView.value.view === id.slice(6))}
            onClick=${() => run(id)}
          >
            ${id === "scene-free" ? t("scene.action.free.short") : t("scene.action.above.short")}
          </button>`,
          )}
        </div>
        ${it.cameras.map(
          (c) => html`<div key=${c.key} class="line">
          <label class="seen grow">
            <input
              type="checkbox"
              data-testid=${`seen-${c.title}`}
              checked=${!sceneView.value.hidden.includes(c.key)}
              onChange=${() => toggleCamera(c.key)}
            />${" "}
            <i class="dot" style=${`background:rgb(${c.colour.join()})`}></i> ${c.title}
          </label>
          ${
            c.height_mm !== null &&
            html`<button
            type="button"
            data-testid=${`through-${c.title}`}
            aria-pressed=${String(
              sceneView.value.view === "camera" && sceneView.value.through === c.key,
            )}
            onClick=${() => changeView({ view: "camera", through: c.key })}
          >
            ${t("scene.views.through")}
          </button>`
          }
        </div>`,
        )}
      </section>
      <section aria-label=${t("scene.layers")}>
        <h2>${t("scene.layers.title")}</h2>
        <ul class="plain">
          ${LAYERS.map(
            ([id, label]) => html`<li key=${id}>
            <label>
              <input
                type="checkbox"
                data-testid=${`layer-${id}`}
                checked=${sceneView.value.layers.includes(id)}
                onChange=${() => toggleLayer(id)}
              />${" "}
              ${label}
            </label>
          </li>`,
          )}
        </ul>
        <${Scale} />
        <h2>${t("common.expected-error")}</h2>
        <div class="switch" role="group" aria-label=${t("common.expected-error")}>
          ${
            /** @type {const} */ (["none", "carpet", "hat"]).map(
              (id) => html`<button
              key=${id}
              type="button"
              data-testid=${`sheet-${id}`}
              aria-pressed=${String(sceneView.value.sheet === id)}
              disabled=${id !== "none" && it.sheet_top_mm === null}
              onClick=${() => changeView({ sheet: id })}
            >
              ${t(`scene.sheet.${id}`)}
            </button>`,
            )
          }
        </div>
        ${
          sceneView.value.sheet !== "none" &&
          it.sheet_top_mm !== null &&
          html`<div class="scene-scale">
          <${MapScale} />
        </div>`
        }
      </section>
    `
    }
  `;
}

/** Which version, rig or lens; of one camera all its versions in time. */
function Which() {
  const now = what.value ?? "",
    all = versions.value,
    at = all.findIndex((v) => v.id === now),
    it = all[at];
  return html`<section aria-label=${t("scene.shown")}>
    <${Title} of="scene">${t("scene.title")}<//>
    <label class="pair tall">
      <span>${t("scene.of")}</span>
      <select
        data-testid="scene-of"
        value=${only.value ? `camera/${only.value.camera}` : now}
        onChange=${(/** @type {Changed} */ e) => choose(e.target.value)}
      >
        ${!now && html`<option value="">${t("scene.of.choose")}</option>`}
        ${cameras.value
          .filter((c) => c.active_calibration)
          .map(
            (c) => html`<option key=${c.id} value=${`camera/${c.id}`}>
            ${c.name}
          </option>`,
          )}
        ${rigs.value.map(
          (r) => html`<option key=${r.name} value=${`rig/${r.name}`}>
          ${t("scene.of.rig", { rig: r.title || r.name })}
        </option>`,
        )}
        ${now.startsWith("lens/") && html`<option value=${now}>${t("scene.of.lens")}</option>`}
        ${
          only.value &&
          !cameras.value.some((c) => c.id === only.value?.camera && c.active_calibration) &&
          html`<option value=${`camera/${only.value.camera}`}>${only.value.title}</option>`
        }
      </select>
    </label>
    ${
      it &&
      html`
      <label class="pair tall">
        <span>
          ${t(it.active ? "scene.version-active" : "scene.version", {
            version: it.version,
            made: dayAndTime(it.created_at),
          })}
        </span>
        <input
          type="range"
          data-testid="scene-version"
          min="0"
          max=${all.length - 1}
          step="1"
          value=${at}
          disabled=${all.length < 2}
          onInput=${(/** @type {Changed} */ e) => showVersion(Number(e.target.value))}
        />
      </label>
      <label class="pair tall">
        <span>${t("scene.before")}</span>
        <select
          data-testid="scene-before"
          value=${before.value}
          disabled=${all.length < 2}
          onChange=${(/** @type {Changed} */ e) => {
            before.value = e.target.value;
          }}
        >
          <option value="">${t("scene.before.none")}</option>
          ${all
            .filter((v) => v.id !== now)
            .map(
              (v) => html`<option key=${v.id} value=${v.id}>
              ${t("scene.before.version", { version: v.version, made: dayAndTime(v.created_at) })}
            </option>`,
            )}
        </select>
      </label>
    `
    }
  </section>`;
}

/** @param {string} chosen */
function choose(chosen) {
  before.value = "";
  if (!chosen.startsWith("camera/")) return go("scene", { scene: chosen });
  const id = cameras.value.find((c) => `camera/${c.id}` === chosen)?.active_calibration;
  if (id) go("scene", { scene: id });
}

/** Residuals and what moved are enlarged alike. */
function Scale() {
  const scale = sceneView.value.scale ?? shownScene.value?.scale ?? 1;
  return html`<label class="pair tall">
    <span>
      ${t(only.value?.moved ? "scene.scale-moved" : "scene.scale", { scale: number(scale, scale < 10 ? 1 : 0) })}
    </span>
    <input
      type="range"
      data-testid="scene-scale"
      min="0"
      max=${3 * LOG}
      value=${Math.round(Math.log10(scale) * LOG)}
      onInput=${(/** @type {Changed} */ e) => changeView({ scale: 10 ** (Number(e.target.value) / LOG) })}
    />
  </label>`;
}

export function ScenePage() {
  const now = what.value;
  if (!now)
    return html`<div class="page" data-testid="scene-page">
      <h1>${t("scene.page.title")}</h1>
      <p class="dim">${t("scene.what")} ${t("scene.page.none-calibrated")}</p>
    </div>`;
  return html`<div class="scene" data-testid="scene-page" data-ready=${String(shownScene.value !== null)}>
    <h1 class="sr">${t("scene.page.title")}</h1>
    ${
      refusal.value &&
      html`<div class="warning-line" role="alert" data-testid="scene-refusal">
      <b>${refusal.value.detail}</b> ${refusal.value.fix}
    </div>`
    }
    ${
      place.value
        ? html`<iframe
        title=${t("scene.page.title")}
        data-testid="scene-frame"
        src=${place.value}
        sandbox="allow-scripts allow-same-origin"
      ></iframe>`
        : !refusal.value && html`<p class="dim">${t("scene.setting-up")}</p>`
    }
  </div>`;
}

export function SceneReport() {
  const it = shownScene.value;
  if (!it)
    return html`<section>
      <${Title} of="scene">${t("scene.title")}<//>
      <p class="reason">${t("scene.what")}</p>
    </section>`;
  return html`
    <${Place} />
    ${
      it.boards &&
      html`<section aria-label=${t("scene.board")} data-testid="scene-boards">
      <h2>${t("scene.board")}</h2>
      <dl class="details">
        <div>
          <dt>${t("scene.board.views")}</dt>
          <dd>${it.boards.boards}</dd>
        </div>
        <div>
          <dt>${t("scene.board.from")}</dt>
          <dd>
            ${t("scene.board.range", {
              nearest: number(it.boards.nearest_mm, 0),
              furthest: number(it.boards.furthest_mm, 0),
            })}
          </dd>
        </div>
        <div>
          <dt>${t("scene.board.covered")}</dt>
          <dd>${t("scene.board.share", { share: number(100 * it.boards.covered, 0) })}</dd>
        </div>
      </dl>
    </section>`
    }
    ${it.missing.map(
      (m) => html`<p key=${m.camera} class="warning-line">
      <b>${m.text}</b> ${m.fix}
    </p>`,
    )}
    ${it.cameras.map((c) => html`<${OneCamera} key=${c.key} it=${c} />`)}
  `;
}

/** @param {{ it: SceneCamera }} props */
function OneCamera({ it }) {
  const sheet = it.sheet[sceneView.value.sheet === "hat" ? "hat" : "carpet"],
    { moved } = it;
  return html`<section aria-label=${it.title} data-testid="scene-camera">
    <h2>
      <i class="dot" style=${`background:rgb(${it.colour.join()})`}></i>${" "}
      ${t("scene.camera.title", { camera: it.title, version: it.version })}
    </h2>
    <dl class="details">
      <div>
        <dt>${t("scene.camera.model")}</dt>
        <dd>${it.model}</dd>
      </div>
      ${
        it.height_mm !== null &&
        html`
        <div>
          <dt>${t("scene.camera.height")}</dt>
          <dd data-testid="scene-height">${number(it.height_mm / 1000, 2)} m</dd>
        </div>
        <div>
          <dt>${t("scene.camera.tilt")}</dt>
          <dd>${number(it.tilt_deg ?? 0, 1)}°</dd>
        </div>
      `
      }
      <div>
        <dt>${t("scene.camera.points")}</dt>
        <dd>${it.points}</dd>
      </div>
      ${
        sheet.max_mm !== null &&
        html`<div>
        <dt>${t("scene.camera.worst")}</dt>
        <dd>${mm(sheet.max_mm)} mm</dd>
      </div>`
      }
    </dl>
    ${
      it.why_no_frustum &&
      html`<p class="warning-line" data-testid="no-frustum">
      ${it.why_no_frustum}
    </p>`
    }
    ${it.why_not_whole && html`<p class="reason">${it.why_not_whole}</p>`}
    ${
      sheet.why &&
      html`<p class="reason">
      ${sheet.why} ${sheet.fix}
    </p>`
    }
    ${
      moved &&
      html`<p class="plainly" data-testid="scene-moved">
      ${rich("scene.moved", { median: mm(moved.median_mm), worst: mm(moved.max_mm) })}
      ${
        moved.shift_mm &&
        ` ${t("scene.moved.camera", {
          shift: number(Math.hypot(...moved.shift_mm), 0),
          turn: number(moved.turn_deg ?? 0, 2),
        })}`
      }
    </p>`
    }
    <p>
      <a
        href=${address(`/calibrations/${it.calibration}/scene.html?dark=${sceneView.value.dark}`)}
        download=${`touchline-v${it.version}-scene.html`}
        data-testid="scene-file"
      >
        ${t("scene.camera.file")}
      </a>${" "}
      ·${" "}
      <a href=${reportAddress(it.calibration)} target="_blank" rel="noopener">
        ${t("scene.camera.report")}
      </a>
    </p>
  </section>`;
}

/** What was clicked on the carpet. */
function Place() {
  const at = clicked.value;
  if (!at) return null;
  return html`<section aria-label=${t("scene.place")} data-testid="scene-place">
    <h2>
      ${number(at.place_mm[0], 0)}, ${number(at.place_mm[1], 0)} mm
    </h2>
    ${at.cameras.map(
      (c) => html`<div key=${c.key} data-testid=${`place-${c.title}`}>
      <b>${c.title}</b>
      ${
        !c.pixel || !c.inside
          ? html`<p class="reason">${t("scene.place.unseen")}</p>`
          : html`
          <dl class="details">
            <div>
              <dt>${t("scene.place.pixel")}</dt>
              <dd data-testid="place-pixel">
                ${number(c.pixel[0], 1)}, ${number(c.pixel[1], 1)}
              </dd>
            </div>
            ${
              c.sigma_mm !== null &&
              html`<div>
              <dt>${t("common.expected-error")}</dt>
              <dd data-testid="place-sigma">${mm(c.sigma_mm)} mm</dd>
            </div>`
            }
            ${
              c.hat_sigma_mm !== null &&
              html`<div>
              <dt>${t("scene.place.hats")}</dt>
              <dd>${mm(c.hat_sigma_mm)} mm</dd>
            </div>`
            }
          </dl>
          ${c.sigma_mm === null && html`<p class="reason">${t("scene.place.no-error")}</p>`}
          ${
            c.snapshot
              ? html`<button type="button" data-testid="place-show" onClick=${() => void showInPicture(c)}>
              ${t("scene.place.show")}
            </button>`
              : html`<p class="reason">${t("scene.place.no-picture")}</p>`
          }
        `
      }
    </div>`,
    )}
  </section>`;
}
