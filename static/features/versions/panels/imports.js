// Imports a calibration: a file chosen or dropped, options beside it, and the result.
import { areaTitle } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { busy, cameras, fields } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { reportAddress } from "../../report/address.js";
import { activateCalibration } from "../activate.js";
import { LensChoices } from "./lens_choices.js";
import { ACCEPTED, importFile, importMessage, importOptions, imported } from "../imports.js";
import { TURNS } from "../turning.js";

/** @typedef {{ target: HTMLInputElement & HTMLSelectElement }} Changed */

export function ImportPage() {
  const { camera, field, region, image_size, turn } = importOptions.value,
    // what can be stated in the form, and not by a button alone
    isAsked = imported.value?.choices.some(({ stated, entries }) => !stated.entry && !entries),
    regions = Object.keys(fields.value.find((f) => f.name === field)?.regions ?? {});
  /** @param {Partial<typeof importOptions.value>} more */
  const setOption = (more) => {
    importOptions.value = { ...importOptions.value, ...more };
  };
  const choose = (/** @type {Changed} */ e) => {
    const file = e.target.files?.[0];
    if (file) void importFile(file);
    e.target.value = "";
  };
  return html`<div class="page" data-testid="import-page">
    <h1>${t("versions.import.title")}</h1>
    <label class="drop choose-file">
      <b>${busy.value || t("versions.import.choose-file")}</b>
      <small>
        ${t("versions.import.drop-file")}
      </small>
      <input
        type="file"
        class="sr"
        data-testid="import-file"
        accept=${ACCEPTED}
        disabled=${busy.value !== ""}
        onChange=${choose}
      />
    </label>
    <details class="more" open=${isAsked || undefined}>
      <summary>${t("versions.import.beside")}</summary>
      <div class="say-beside">
        <label>
          ${t("versions.import.camera")}${" "}
          <select
            data-testid="import-camera"
            value=${camera}
            onChange=${(/** @type {Changed} */ e) => setOption({ camera: e.target.value })}
          >
            <option value="">${t("versions.import.as-file-says")}</option>
            ${cameras.value.map(
              (c) => html`<option key=${c.id} value=${c.id}>
              ${c.name}
            </option>`,
            )}
          </select>
        </label>
        <label>
          ${t("versions.import.field")}${" "}
          <select
            data-testid="import-field"
            value=${field}
            onChange=${(/** @type {Changed} */ e) => setOption({ field: e.target.value, region: "" })}
          >
            <option value="">${t("versions.import.as-file-says")}</option>
            ${fields.value.map(
              (f) => html`<option key=${f.name} value=${f.name}>
              ${f.title}
            </option>`,
            )}
          </select>
        </label>
        <label>
          ${t("versions.import.region")}${" "}
          <select
            data-testid="import-region"
            value=${region}
            disabled=${!regions.length}
            onChange=${(/** @type {Changed} */ e) => setOption({ region: e.target.value })}
          >
            <option value="">${t("versions.import.as-file-says")}</option>
            ${regions.map(
              (name) => html`<option key=${name} value=${name}>
              ${areaTitle(name)}
            </option>`,
            )}
          </select>
        </label>
        <label>
          ${t("versions.import.picture-size")}${" "}
          <input
            type="text"
            data-testid="import-size"
            placeholder="1280x1024"
            maxlength="11"
            value=${image_size}
            onInput=${(/** @type {Changed} */ e) => setOption({ image_size: e.target.value.trim() })}
          />
        </label>
        <label>
          ${t("versions.import.turn")}${" "}
          <select
            data-testid="import-turn"
            value=${turn}
            onChange=${(/** @type {Changed} */ e) => setOption({ turn: e.target.value })}
          >
            <option value="">${t("versions.import.not-turned")}</option>
            ${TURNS.map(
              ({ degrees, label }) => html`<option key=${degrees} value=${degrees}>
              ${label}
            </option>`,
            )}
          </select>
        </label>
      </div>
    </details>
    <${Became} />
  </div>`;
}

/** What became of the last file: where it is now, or why not and what to do. */
function Became() {
  const it = imported.value;
  if (!it) return null;
  if (it.why)
    return html`<div class="warning-line" role="alert" data-testid="import-refusal">
      <b>${it.why.detail}</b> ${it.why.fix}
      ${
        it.choices.some((choice) => choice.lens)
          ? html`<${LensChoices} choices=${it.choices} choose=${it.choose} />`
          : it.choices.length > 0 &&
            html`<div class="line">
        ${it.choices.map(
          (choice) => html`<button
          type="button"
          key=${choice.label}
          data-testid="import-choice"
          onClick=${() => it.choose(choice)}
        >
          ${choice.label}
        </button>`,
        )}
      </div>`
      }
    </div>`;
  const { kept } = it;
  return (
    kept &&
    html`<div class="plainly" role="status" data-testid="imported">
      <p>
        <b>${importMessage(kept)}</b> ${kept.note}
      </p>
      ${
        !kept.isLens &&
        html`<div class="line">
        <a href=${reportAddress(kept.id)} target="_blank" rel="noopener">
          ${t("versions.import.open-report")}
        </a>
        ${
          kept.camera &&
          html`<button type="button" data-testid="import-activate" onClick=${() => void activateCalibration(kept)}>
            ${t("versions.import.activate")}
          </button>`
        }
      </div>`
      }
    </div>`
  );
}
