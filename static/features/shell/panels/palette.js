// The palette: one field that finds any place, camera, version, image, manual page and action.
import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { isOpen, results, wanted } from "../palette.js";

/** Which result Enter takes. */
const chosen = signal(0);

export const Palette = () => isOpen.value && html`<${Search} />`;

function Search() {
  const dialog = useRef(/** @type {HTMLDialogElement | null} */ (null)),
    all = results.value,
    at = Math.min(chosen.value, all.length - 1);
  useEffect(() => {
    chosen.value = 0;
    dialog.current?.showModal();
  }, []);
  useEffect(() => {
    document.getElementById(`found-${at}`)?.scrollIntoView({ block: "nearest" });
  }, [at]);
  /** @param {number} index */
  const take = (index) => {
    dialog.current?.close(); // first: what is done may look for another dialog
    all[index]?.run();
  };
  /** @param {KeyboardEvent} e */
  const press = (e) => {
    const by = { ArrowDown: 1, ArrowUp: -1 }[e.key];
    if (by && all.length) chosen.value = (at + by + all.length) % all.length;
    else if (e.key !== "Enter") return;
    else if (all.length) take(at); // else what it may find is still on its way
    e.preventDefault();
  };
  return html`<dialog
    ref=${dialog}
    class="palette-dialog"
    data-testid="palette"
    aria-label=${t("shell.palette.title")}
    onClose=${() => {
      isOpen.value = false;
    }}
  >
    <input
      type="text"
      data-testid="palette-input"
      role="combobox"
      aria-label=${t("shell.palette.title")}
      aria-expanded="true"
      aria-controls="found"
      aria-activedescendant=${all.length ? `found-${at}` : undefined}
      autocomplete="off"
      spellcheck="false"
      placeholder=${t("shell.palette.placeholder")}
      value=${wanted.value}
      onInput=${(/** @type {any} */ e) => {
        wanted.value = e.target.value;
        chosen.value = 0;
      }}
      onKeyDown=${press}
    />
    <ul id="found" role="listbox" aria-label=${t("shell.palette.found")}>
      ${all.map(
        ({ kind, label, hint }, i) => html`<li
        key=${i}
        id=${`found-${i}`}
        role="option"
        data-testid="found"
        aria-selected=${String(i === at)}
        onClick=${() => take(i)}
      >
        <small>${kind}</small>
        <span>${label}</span>
        ${hint && html`<kbd>${hint}</kbd>`}
      </li>`,
      )}
    </ul>
    ${!all.length && html`<p class="reason">${t("shell.palette.nothing")}</p>`}
  </dialog>`;
}
