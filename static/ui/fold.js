// A part of the page that is closed until it is asked for: its name and its figure stand in one line.
import { isUnfolded, unfold } from "../core/folds.js";
import { html } from "../core/html.js";

/** @param {{ id: import("../core/folds.js").Fold, title: string, value?: any, children?: any }} props */
export function Fold({ id, title, value, children }) {
  const isOpen = isUnfolded(id);
  return html`<details
    class="fold"
    data-testid=${`fold-${id}`}
    open=${isOpen}
    onToggle=${(/** @type {any} */ e) => unfold(id, e.target.open)}
  >
    <summary>
      <h2>${title}</h2>
      <em>${value}</em>
    </summary>
    ${isOpen && children}
  </details>`;
}
