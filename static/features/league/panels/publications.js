// Which cameras are shown: those of a rig that is published separately, or all others.
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { changing, endSeparateRig, separateRig, showRig } from "../network.js";

/** @param {{ it: import("../types").Publishing }} props */
export function Publications({ it }) {
  if (!it.rigs.length) return null;
  const separate = it.rigs.filter((rig) => rig.separate),
    others = it.rigs.filter((rig) => !rig.separate);
  return html`<div class="line wrap" data-testid="publications">
    ${
      separate.length > 0 &&
      html`<label>
      ${t("network.rig")}${" "}
      <select
        data-testid="network-rig"
        value=${it.rig}
        onChange=${(/** @type {any} */ e) => showRig(e.target.value)}
      >
        <option value="">${t("network.rig.others")}</option>
        ${separate.map((rig) => html`<option key=${rig.name} value=${rig.name}>${rig.title}</option>`)}
      </select>
    </label>`
    }
    ${
      others.length > 0 &&
      html`<select
      data-testid="network-separate"
      aria-label=${t("network.rig.separate")}
      title=${t("network.rig.separate.hint")}
      value=""
      disabled=${changing.value}
      onChange=${(/** @type {any} */ e) => void separateRig(e.target.value)}
    >
      <option value="">${t("network.rig.separate")}</option>
      ${others.map((rig) => html`<option key=${rig.name} value=${rig.name}>${rig.title}</option>`)}
    </select>`
    }
    ${
      it.rig &&
      html`<button
      type="button"
      data-testid="network-together"
      disabled=${changing.value || it.enabled}
      title=${it.enabled ? t("network.rig.together.first") : t("network.rig.together.hint")}
      onClick=${() => void endSeparateRig()}
    >
      ${t("network.rig.together")}
    </button>`
    }
  </div>`;
}
