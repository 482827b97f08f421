// The form of a new rig: its field, its cameras, and the part that each shows.
import { run } from "../../../core/actions.js";
import { areaTitle } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { cameras, fields } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { draft, draftRefusal, chooseField, setDraft, setRegion, toggleCamera } from "../rig.js";

/** @typedef {{ target: HTMLInputElement & HTMLSelectElement }} Changed */

export function NewRig() {
  const { name, title, field, cameras: chosen } = draft.value,
    regions = Object.keys(fields.value.find((f) => f.name === field)?.regions ?? {});
  return html`<div class="page rig" data-testid="new-rig-page">
    <h1>${t("rig.new.title")}</h1>
    <label class="pair tall">
      <span>${t("rig.new.short-name")}</span>
      <input
        type="text"
        data-testid="rig-name"
        value=${name}
        maxlength="64"
        onInput=${(/** @type {Changed} */ e) => setDraft({ name: e.target.value.trim() })}
      />
    </label>
    <label class="pair tall">
      <span>${t("rig.new.rig-title")}</span>
      <input
        type="text"
        value=${title}
        maxlength="100"
        onInput=${(/** @type {Changed} */ e) => setDraft({ title: e.target.value })}
      />
    </label>
    <label class="pair tall">
      <span>${t("rig.new.field")}</span>
      <select
        data-testid="rig-field"
        value=${field}
        onChange=${(/** @type {Changed} */ e) => chooseField(e.target.value)}
      >
        ${fields.value.map((f) => html`<option key=${f.name} value=${f.name}>${f.title}</option>`)}
      </select>
    </label>
    <section aria-label=${t("rig.new.cameras")}>
      <h2>${t("rig.new.cameras")}</h2>
      <ul class="plain">
        ${cameras.value.map((c) => {
          const on = chosen.find((it) => it.camera === c.id);
          return html`<li key=${c.id} class="line">
            <label>
              <input
                type="checkbox"
                data-testid=${`with-${c.id}`}
                checked=${Boolean(on)}
                onChange=${() => toggleCamera(c.id)}
              />${" "}
              ${c.name}
            </label>
            ${
              on &&
              html`<select
              aria-label=${t("rig.new.part", { camera: c.name })}
              data-testid=${`part-${c.id}`}
              value=${on.region ?? ""}
              onChange=${(/** @type {Changed} */ e) => setRegion(c.id, e.target.value || null)}
            >
              <option value="">${t("rig.new.part.calibrated")}</option>
              ${regions.map((r) => html`<option key=${r} value=${r}>${areaTitle(r)}</option>`)}
            </select>`
            }
          </li>`;
        })}
      </ul>
    </section>
    ${
      draftRefusal.value &&
      html`<div class="warning-line" role="alert" data-testid="rig-refusal">
      <b>${draftRefusal.value.detail}</b> ${draftRefusal.value.fix}
    </div>`
    }
    <div class="line">
      <button type="button" class="go" data-testid="make-rig" onClick=${() => run("make-rig")}>
        ${t("rig.make")}
      </button>
    </div>
  </div>`;
}
