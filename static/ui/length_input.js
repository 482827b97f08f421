// An input for a length in mm that takes other units as well, and says in words where it understood one.
import { useState } from "preact/hooks";
import { number } from "../core/format.js";
import { html } from "../core/html.js";
import { parseLength } from "../core/length.js";
import { t } from "../core/words.js";
import { Typed } from "./typed.js";

/**
 * `take` gets millimetres, or null where the input was emptied; what is no length is said, and not taken.
 * @param {{ value: number | null, take: (mm: number | null) => unknown, range?: [number, number] | null,
 *   [attribute: string]: unknown }} props
 */
export function LengthInput({ value, take, range = null, ...about }) {
  const [note, setNote] = useState("");
  const takeText = (/** @type {string} */ text) => {
    const length = parseLength(text, range);
    setNote(text.trim() === "" ? "" : noteOn(text.trim(), length));
    if (text.trim() === "") return take(null);
    return length && take(length.mm);
  };
  return html`
    <${Typed}
      type="text"
      inputmode="decimal"
      autocomplete="off"
      class="number"
      ...${about}
      value=${value ?? ""}
      take=${takeText}
    />
    ${note && html`<small class="understood" role="status" data-testid="understood">${note}</small>`}
  `;
}

/** @param {string} typed @param {import("../core/length.js").Length | null} length */
function noteOn(typed, length) {
  if (!length) return t("ui.length.not-a-length", { typed });
  return length.isGuessed || length.unit !== "mm"
    ? t(`ui.length.understood-${length.unit}`, {
        typed,
        mm: number(length.mm, length.mm % 1 ? 1 : 0),
      })
    : "";
}
