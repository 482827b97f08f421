// Where no known field is recognised: a new one from the lines of the image, of a length that the operator types.
import { useState } from "preact/hooks";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { notProposed, proposeField, proposing } from "../proposed.js";

const SHORTEST_MM = 100,
  LONGEST_MM = 100_000; // as the server takes them

export function ProposeField() {
  const [length, setLength] = useState("");
  const isLength = Number(length) >= SHORTEST_MM && Number(length) <= LONGEST_MM;
  return html`<form
    class="line wrap"
    data-testid="propose-field"
    onSubmit=${(/** @type {Event} */ event) => {
      event.preventDefault();
      if (isLength) void proposeField(Number(length));
    }}
  >
    <label class="pair tall">
      <span>${t("calibrate.propose-field.length")}</span>
      <input
        type="number"
        step="any"
        min=${SHORTEST_MM}
        max=${LONGEST_MM}
        data-testid="propose-length"
        value=${length}
        onInput=${(/** @type {{ target: HTMLInputElement }} */ { target }) => setLength(target.value)}
      />
    </label>
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
