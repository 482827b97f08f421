// Saved versions: what can be downloaded, which one the camera uses, and how to go back.
import { address } from "../../../core/api.js";
import { dayAndTime, mm, pct } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { camera } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { Typed } from "../../../ui/typed.js";
import { correctedAddress } from "../../../canvas/layers/compare.js";
import { HeatPanel } from "../../compare/panels/heat.js";
import { activateCalibration } from "../activate.js";
import { annotateVersion, isSaved, version, versions } from "../versions.js";
import { ExportMenu } from "./exports.js";

export function ComparePanel() {
  const it = version.value;
  if (!it)
    return html`<section>
      <h2>Compare</h2>
      <p class="dim">Nothing is saved to compare yet.</p>
      <div class="line">
        <${ActionButton} id="step-points" label="Go to points" />
      </div>
    </section>`;
  const { before_pct, after_pct } = it.report.distortion;
  return html`
    <section aria-label="Compare">
      <${Title} of="compare">
        Version ${it.version}, ${dayAndTime(it.created_at)}
      <//>
      ${!isSaved.value && html`<p class="warning-line" data-testid="changed">
        The clicks have changed since; this is what was saved.
      </p>`}
      <ul class="plain facts">
        <li>
          Corrected picture${" "}
          <b>
            ${it.corrected_size[0]} × ${it.corrected_size[1]} px
          </b>
        </li>
        <li>
          Distortion${" "}
          <b>
            ${pct(before_pct)} % → ${pct(after_pct)} %
          </b>
        </li>
      </ul>
      <p class="dim">
        Drag the bar across the picture: what is bent on the left must be straight on the right. Press L to
        lay the field's lines over both.
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
  return html`<section aria-label="Downloads">
    <${Title} of="downloads">Download<//>
    <ul class="plain downloads">
      <li>
        <a
          data-testid="report"
          href=${address(`/calibrations/${it.id}/report.html`)}
          target="_blank"
          rel="noopener"
        >
          Open report, to print or keep
        </a>
        <small>Pictures, numbers, error maps, versions.</small>
      </li>
      <li>
        <a data-testid="scene-link" href=${addressOf("scene", { scene: it.id })}>
          Show the scene in 3-D
        </a>
        <small>Where the camera hangs, and where its rays miss.</small>
      </li>
      <li>
        <a data-testid="download-json" href=${link("json")} download=${`${name}.json`}>
          Download calibration (JSON)
        </a>
        <small>Everything; can be read back.</small>
      </li>
      <li>
        <a data-testid="download-npz" href=${link("npz")} download=${`${name}.npz`}>
          Download remap table (NPZ)
        </a>
        <small>For cv2.remap in your own program.</small>
      </li>
      <li>
        <a data-testid="download-png" href=${correctedAddress(it.id, "png")} download=${`${name}.png`}>
          Download corrected picture (PNG)
        </a>
      </li>
    </ul>
    <${ExportMenu} it=${it} />
  </section>`;
}

function Note() {
  const it = version.value;
  return (
    it && html`<section aria-label="Note">
      <h2>Note for version ${it.version}</h2>
      <${Typed}
        type="text"
        data-testid="note"
        maxlength="2000"
        aria-label=${`Note for version ${it.version}`}
        placeholder="after the lens was cleaned"
        value=${it.note}
        take=${(/** @type {string} */ text) => void annotateVersion(it, text)}
      />
    </section>`
  );
}

export function VersionsPanel() {
  return html`
    <section aria-label="Versions">
      <${Title} of="versions">${camera.value ? `Versions for ${camera.value.name}` : "Saved versions"}<//>
      <ul class="versions" data-testid="versions">
        ${versions.value.map((v) => html`<li key=${v.id} class=${v.id === version.value?.id ? "now" : ""}>
          <div>
            <b>Version ${v.version}</b>
            ${v.active && html`
              ${" "}
              <b class="level good">Active</b>
            `}
          </div>
          <em>${mm(v.report.verdict.mm)} mm</em>
          <small>
            ${dayAndTime(v.created_at)}
            ${v.note && `, ${v.note}`}
          </small>
          ${camera.value && !v.active && 
            html`<button
              type="button"
              data-testid=${`activate-${v.version}`}
              onClick=${() => void activateCalibration(v)}
            >
              Activate
            </button>`}
        </li>`)}
      </ul>
      <p>
        <a
          data-testid="all-versions"
          href=${addressOf("versions", { camera: camera.value?.id })}
        >
          Show all versions, their history, notes and differences
        </a>
      </p>
      ${camera.value === null && html`<p class="dim">
        The picture is a file, so there is no camera to activate it for. Download it, or use it over REST.
      </p>`}
    </section>
    <${Note} />
    <${Downloads} />
  `;
}
