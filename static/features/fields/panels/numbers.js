// Inputs of the field editor: each knows the entry of the field that it shows, and marks it where that was refused.
import { html } from "../../../core/html.js";
import { notify } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { LengthInput } from "../../../ui/length_input.js";
import { Typed } from "../../../ui/typed.js";
import { edit, isShipped, refusal } from "../editor.js";

/** @typedef {import("../types").FieldDoc} FieldDoc */

/** Whether the server refused this entry, or what is within it. @param {string} entry */
const isRefused = (entry) => {
  const refused = refusal.value?.entry ?? "";
  return (
    refused !== "" &&
    (refused === entry ||
      refused.startsWith(`${entry}.`) ||
      entry.startsWith(`${refused}.`) ||
      entry.startsWith(`${refused}[`))
  );
};

/**
 * A number of the field, mm unless said otherwise.
 * @param {{ label: string, entry: string, value: number, set: (doc: FieldDoc, value: number) => FieldDoc,
 *   unit?: string,
 * range?: [number, number] | null }} props
 */
export const NumberInput = ({
  label,
  entry,
  value,
  set,
  range = null,
  unit = "mm",
}) => html`<label class="pair length">
  <span>${label}</span>
  <span class="with-unit">
    <${unit === "mm" ? LengthInput : PlainNumber}
      data-testid=${`entry-${entry}`}
      aria-invalid=${isRefused(entry) ? "true" : undefined}
      aria-describedby=${isRefused(entry) ? "field-refusal" : undefined}
      disabled=${isShipped.value}
      range=${range}
      value=${value}
      take=${(/** @type {number | null} */ number) =>
        number === null ? refuseNumber(label, entry) : edit((doc) => set(doc, number))}
    />
    <small>${unit}</small>
  </span>
</label>`;

/**
 * A number that is no length.
 * @param {{ take: (number: number | null) => unknown, [attribute: string]: unknown }} props
 */
const PlainNumber = ({ take, ...about }) => html`<${Typed}
  type="number"
  step="any"
  ...${about}
  take=${(/** @type {string} */ text) =>
    take(text.trim() === "" || !Number.isFinite(Number(text)) ? null : Number(text))}
/>`;

/** @param {string} label @param {string} entry */
const refuseNumber = (label, entry) =>
  notify({
    level: "warn",
    text: t("field-editor.not-a-number", { label }),
    fix: t("field-editor.not-a-number-fix"),
    about: `entry/${entry}`,
  });

/**
 * A text of the field.
 * @param {{ label: string, entry: string, value: string, set: (doc: FieldDoc, value: string) => FieldDoc }} props
 */
export const TextInput = ({ label, entry, value, set }) => html`<label class="pair tall">
  <span>${label}</span>
  <${Typed}
    type="text"
    spellcheck=${false}
    autocomplete="off"
    data-testid=${`entry-${entry}`}
    aria-invalid=${isRefused(entry) ? "true" : undefined}
    aria-describedby=${isRefused(entry) ? "field-refusal" : undefined}
    disabled=${isShipped.value}
    value=${value}
    take=${(/** @type {string} */ text) => edit((doc) => set(doc, text.trim()))}
  />
</label>`;
