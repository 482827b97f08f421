// Where no known field is recognised: a new one from the lines of the image, of a length that the operator types.
import { useState } from "preact/hooks";
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { parseLength } from "../../../core/length.js";
import { t } from "../../../core/words.js";
import { notProposed, proposeField, proposing } from "../proposed.js";

const SHORTEST_MM = 100,
  LONGEST_MM = 100_000; // as the server takes them
const RANGE = /** @type {[number, number]} */ ([1000, LONGEST_MM]); // a bare 9 is metres

export function ProposeField() {
  const [length, setLength] = useState("");
  const { mm = 0 } = parseLength(length, RANGE) ?? {},
    isLength = mm >= SHORTEST_MM && mm <= LONGEST_MM;
  return html`<form
    class="line wrap"
    data-testid="propose-field"
    onSubmit=${(/** @type {Event} */ event) => {
      event.preventDefault();
      if (isLength) void proposeField(mm);
    }}
  >
    <label class="pair tall">
      <span>${t("calibrate.propose-field.length")}</span>
      <input
        type="text"
        inputmode="decimal"
        autocomplete="off"
        class="number"
        data-testid="propose-length"
        value=${length}
        onInput=${(/** @type {{ target: HTMLInputElement }} */ { target }) => setLength(target.value)}
      />
    </label>
    ${
      isLength &&
      String(mm) !== length.trim() &&
      html`<small class="understood" role="status">
      ${t("ui.length.understood-mm", { typed: length.trim(), mm: number(mm, 0) })}
    </small>`
    }
    <button type="submit" data-testid="propose" disabled=${!isLength || proposing.value}>
      ${t(proposing.value ? "calibrate.propose-field.busy" : "calibrate.propose-field.propose")}
    </button>
    ${
      notProposed.value &&
      html`<p class="reason" role="alert" data-testid="not-proposed">
      ${notProposed.value.detail} ${notProposed.value.fix}
    </p>`
    }
  </form>`;
}
