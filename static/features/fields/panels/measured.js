// Measured as it is: tape distances, what they make of the field, and the offsets that a calibration has found.
import { lineTitle, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { cameras } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { Fold } from "../../../ui/fold.js";
import { LengthInput } from "../../../ui/length_input.js";
import { isShipped } from "../editor.js";
import {
  addSeen,
  adjustToTape,
  adoptOffsets,
  canAdjust,
  distances,
  found,
  measuring,
  setDistances,
} from "../measured.js";

/** @typedef {import("../types").FieldDoc} FieldDoc */

const FIRST = [
  ["corner-top-left", "corner-top-right"],
  ["corner-bottom-left", "corner-bottom-right"],
  ["corner-top-left", "corner-bottom-left"],
  ["corner-top-right", "corner-bottom-right"],
  ["corner-top-left", "corner-bottom-right"],
  ["corner-top-right", "corner-bottom-left"],
];
const WORTH_MM = 1; // a line that lies less aside is where it should be

/** @param {{ doc: FieldDoc }} props */
export function Measured({ doc }) {
  if (isShipped.value) return null;
  return html`<${Fold} id="measured" title=${t("field-editor.measured.heading")} value=${distances.value.length || ""}>
    <p class="reason">${t("field-editor.measured.how")}</p>
    <ol class="plain distances">
      ${distances.value.map((_, i) => html`<${Row} key=${i} doc=${doc} i=${i} />`)}
    </ol>
    <div class="line wrap">
      <button
        type="button"
        data-testid="add-distance"
        onClick=${() => {
          const [from, to] = FIRST[distances.value.length] ?? ["", ""];
          const known = (/** @type {string} */ name) => (name in doc.landmarks ? name : "");
          setDistances([...distances.value, { from: known(from), to: known(to), mm: null }]);
        }}
      >
        ${t("field-editor.measured.add")}
      </button>
      <button
        type="button"
        data-testid="adjust-to-tape"
        disabled=${!canAdjust()}
        onClick=${() => void adjustToTape()}
      >
        ${t("field-editor.measured.adjust")}
      </button>
    </div>
    <${Adopt} />
    <${Found} />
  <//>`;
}

/** @param {{ doc: FieldDoc, i: number }} props */
function Row({ doc, i }) {
  const it = distances.value[i],
    left = found.value?.residuals_mm?.[i];
  /** @param {Partial<import("../measured.js").Distance>} changes */
  const set = (changes) =>
    setDistances(distances.value.map((d, j) => (j === i ? Object.assign({}, d, changes) : d)));
  const spot = (/** @type {"from" | "to"} */ end) => html`<select
    aria-label=${t(`field-editor.measured.distance-${end}`, { number: i + 1 })}
    data-testid=${`distance-${i}-${end}`}
    value=${it[end]}
    onChange=${(/** @type {any} */ e) => set({ [end]: e.target.value })}
  >
    <option value="">${t("field-editor.measured.choose-landmark")}</option>
    ${Object.keys(doc.landmarks).map(
      (name) => html`<option key=${name} value=${name}>
      ${lineTitle(name)}
    </option>`,
    )}
  </select>`;
  return html`<li>
    ${spot("from")}${spot("to")}
    <span class="line">
      <${LengthInput}
        aria-label=${t("field-editor.measured.distance-mm", { number: i + 1 })}
        data-testid=${`distance-${i}-mm`}
        value=${it.mm ?? null}
        take=${(/** @type {number | null} */ mm) => set({ mm: mm !== null && mm > 0 ? mm : null })}
      />
      <small>mm</small>
      ${
        left !== undefined &&
        html`<small title=${t("field-editor.measured.left-explained")}>
        ${t("field-editor.measured.left", { difference: `${left > 0 ? "+" : ""}${number(left)}` })}
      </small>`
      }
      <button
        type="button"
        class="remove"
        aria-label=${t("field-editor.measured.remove", { number: i + 1 })}
        onClick=${() => setDistances(distances.value.filter((_, j) => j !== i))}
      >
        ✕
      </button>
    </span>
  </li>`;
}

/** What active calibrations can tell: where the lines lie, and which others are there. */
function Adopt() {
  const calibrated = cameras.value.filter((c) => c.active);
  if (!calibrated.length) return null;
  /** @param {string} id @param {string} label @param {(calibration: string) => unknown} take */
  const choice = (id, label, take) => html`<label class="pair tall">
    <span>${label}</span>
    <select
      data-testid=${id}
      value=""
      disabled=${measuring.value}
      onChange=${(/** @type {any} */ e) => {
        const version = e.target.value;
        e.target.value = "";
        if (version) void take(version);
      }}
    >
      <option value="">${t("field-editor.choose-camera")}</option>
      ${calibrated.map(
        (c) => html`<option key=${c.id} value=${c.active?.id}>
        ${t("field-editor.measured.version", { camera: c.name, version: c.active?.version ?? "" })}
      </option>`,
      )}
    </select>
  </label>`;
  return html`
    ${choice("adopt-offsets", t("field-editor.measured.adopt"), adoptOffsets)}
    ${choice("add-seen", t("field-editor.measured.add-seen"), addSeen)}
  `;
}

/** How far each line lay beside its place. */
function Found() {
  const it = found.value;
  if (!it) return null;
  if (it.added)
    return html`<p class="plainly" role="status" data-testid="found-seen">
      ${
        it.added.length
          ? t("field-editor.measured.added", { count: it.added.length })
          : t("field-editor.measured.nothing-added")
      }
    </p>`;
  const aside = Object.entries(it.offsets ?? {}).filter(([, { mm }]) => Math.abs(mm) >= WORTH_MM);
  return html`<div role="status" data-testid="found-offsets">
    ${
      aside.length
        ? html`<dl class="details">
        ${aside.map(
          ([name, { mm, sigma_mm: sigma }]) => html`<div key=${name}>
          <dt>${lineTitle(name)}</dt>
          <dd>${number(mm)}${sigma !== null && ` ± ${number(sigma)}`} mm</dd>
        </div>`,
        )}
      </dl>`
        : html`<p class="reason">${t("field-editor.measured.in-place", { limit: WORTH_MM })}</p>`
    }
    <p class="reason">${t("field-editor.measured.adjusted")}</p>
  </div>`;
}
