// Saved versions: what can be downloaded, which one the camera uses, and how to go back.
import { correctedAddress } from "../../../canvas/layers/compare.js";
import { address } from "../../../core/api.js";
import { dayAndTime, mm } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { camera } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { Fold } from "../../../ui/fold.js";
import { Title } from "../../../ui/title.js";
import { Typed } from "../../../ui/typed.js";
import { Details } from "../../calibrate/panels/verdict.js";
import { isMapWanted } from "../../compare/heat.js";
import { HeatPanel } from "../../compare/panels/heat.js";
import { reportAddress } from "../../report/address.js";
import { activateCalibration } from "../activate.js";
import { annotateVersion, version, versions } from "../versions.js";
import { ExportMenu } from "./exports.js";

/** What can be looked at, opened and downloaded of the version on show: a line each until it is asked for. */
export function VersionTools() {
  const it = version.value;
  if (!it) return null;
  const now = versions.value.find((v) => v.active);
  return html`
    <div class="line">
      <a class="as-button" data-testid="report" href=${reportAddress(it.id)} target="_blank" rel="noopener">
        ${t("versions.report")}
      </a>
      <a class="as-button" data-testid="scene-link" href=${addressOf("scene", { scene: it.id })}>
        ${t("versions.scene")}
      </a>
    </div>
    <div class="folds">
      <${Fold} id="map" title=${t("compare.heat.panel")} isWanted=${isMapWanted.value}>
        <p class="dim">${t("versions.compare.how")}</p>
        <${HeatPanel} />
      <//>
      <${Details} report=${it.report} />
      <${Fold}
        id="versions"
        title=${t("versions.versions")}
        value=${now ? t("versions.now-active", { version: now.version }) : t("versions.none-active")}
      >
        <${Versions} />
      <//>
      <${Fold} id="export" title=${t("versions.export")}>
        <${Downloads} it=${it} />
      <//>
    </div>
  `;
}

/** @param {{ it: import("../../../core/types").Calibration }} props */
function Downloads({ it }) {
  const name = `touchline-v${it.version}`,
    [width, height] = it.corrected_size,
    link = (/** @type {string} */ format) => address(`/calibrations/${it.id}/export/${format}`);
  return html`<section aria-label=${t("versions.export")}>
    <${Title} of="downloads">${t("versions.downloads.title")}<//>
    <ul class="plain downloads">
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
        <small>${width} × ${height} px</small>
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

function Versions() {
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
  `;
}
