// Saved versions: what can be downloaded, which one the camera uses, and how to go back.
import { correctedAddress } from "../../../canvas/layers/compare.js";
import { address } from "../../../core/api.js";
import { dayAndTime, mm, pct } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { camera } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { Typed } from "../../../ui/typed.js";
import { HeatPanel } from "../../compare/panels/heat.js";
import { reportAddress } from "../../report/address.js";
import { activateCalibration } from "../activate.js";
import { annotateVersion, isSaved, version, versions } from "../versions.js";
import { ExportMenu } from "./exports.js";

export function ComparePanel() {
  const it = version.value;
  if (!it)
    return html`<section>
      <h2>${t("versions.compare")}</h2>
      <p class="dim">${t("versions.compare.nothing")}</p>
      <div class="line">
        <${ActionButton} id="step-points" label=${t("versions.compare.go-to-points")} />
      </div>
    </section>`;
  const { before_pct, after_pct } = it.report.distortion;
  return html`
    <section aria-label=${t("versions.compare")}>
      <${Title} of="compare">
        ${t("versions.compare.version", { version: it.version, time: dayAndTime(it.created_at) })}
      <//>
      ${
        !isSaved.value &&
        html`<p class="warning-line" data-testid="changed">
        ${t("versions.compare.changed")}
      </p>`
      }
      <ul class="plain facts">
        <li>
          ${t("versions.compare.corrected")}${" "}
          <b>
            ${it.corrected_size[0]} × ${it.corrected_size[1]} px
          </b>
        </li>
        <li>
          ${t("common.distortion")}${" "}
          <b>
            ${pct(before_pct)} % → ${pct(after_pct)} %
          </b>
        </li>
      </ul>
      <p class="dim">
        ${t("versions.compare.how")}
      </p>
    </section>
    <${HeatPanel} />
  `;
}

export function Downloads() {
  const it = version.value;
  if (!it) return null;
  const name = `touchline-v${it.version}`,
    link = (/** @type {string} */ format) => address(`/calibrations/${it.id}/export/${format}`);
  return html`<section aria-label=${t("versions.downloads")}>
    <${Title} of="downloads">${t("versions.downloads.title")}<//>
    <ul class="plain downloads">
      <li>
        <a data-testid="report" href=${reportAddress(it.id)} target="_blank" rel="noopener">
          ${t("versions.downloads.report")}
        </a>
        <small>${t("versions.downloads.report.holds")}</small>
      </li>
      <li>
        <a data-testid="scene-link" href=${addressOf("scene", { scene: it.id })}>
          ${t("versions.downloads.scene")}
        </a>
        <small>${t("versions.downloads.scene.holds")}</small>
      </li>
      <li>
        <a data-testid="download-json" href=${link("json")} download=${`${name}.json`}>
          ${t("versions.downloads.json")}
        </a>
        <small>${t("versions.downloads.json.holds")}</small>
      </li>
      <li>
        <a data-testid="download-npz" href=${link("npz")} download=${`${name}.npz`}>
          ${t("versions.downloads.npz")}
        </a>
        <small>${t("versions.downloads.npz.holds")}</small>
      </li>
      <li>
        <a data-testid="download-png" href=${correctedAddress(it.id, "png")} download=${`${name}.png`}>
          ${t("versions.downloads.png")}
        </a>
      </li>
    </ul>
    <${ExportMenu} it=${it} />
  </section>`;
}

function Note() {
  const it = version.value;
  return (
    it &&
    html`<section aria-label=${t("versions.note")}>
      <h2>${t("versions.note-for", { version: it.version })}</h2>
      <${Typed}
        type="text"
        data-testid="note"
        maxlength="2000"
        aria-label=${t("versions.note-for", { version: it.version })}
        placeholder=${t("versions.note.example")}
        value=${it.note}
        take=${(/** @type {string} */ text) => void annotateVersion(it, text)}
      />
    </section>`
  );
}

export function VersionsPanel() {
  return html`
    <section aria-label=${t("versions.versions")}>
      <${Title} of="versions">
        ${camera.value ? t("versions.versions-for", { camera: camera.value.name }) : t("versions.saved-versions")}
      <//>
      <ul class="versions" data-testid="versions">
        ${versions.value.map(
          (v) => html`<li key=${v.id} class=${v.id === version.value?.id ? "now" : ""}>
          <div>
            <b>${t("versions.version", { version: v.version })}</b>
            ${
              v.active &&
              html`
              ${" "}
              <b class="level good">${t("common.active")}</b>
            `
            }
          </div>
          <em>${mm(v.report.verdict.mm)} mm</em>
          <small>
            ${dayAndTime(v.created_at)}
            ${v.note && `, ${v.note}`}
          </small>
          ${
            camera.value &&
            !v.active &&
            html`<button
              type="button"
              data-testid=${`activate-${v.version}`}
              onClick=${() => void activateCalibration(v)}
            >
              ${t("versions.activate")}
            </button>`
          }
        </li>`,
        )}
      </ul>
      <p>
        <a
          data-testid="all-versions"
          href=${addressOf("versions", { camera: camera.value?.id })}
        >
          ${t("versions.show-all")}
        </a>
      </p>
      ${
        camera.value === null &&
        html`<p class="dim">
        ${t("versions.of-file")}
      </p>`
      }
    </section>
    <${Note} />
    <${Downloads} />
  `;
}
