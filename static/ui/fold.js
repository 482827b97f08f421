// A part of the page that is closed until it is asked for: its name and its figure stand in one line.
import { isUnfolded, unfold } from "../core/folds.js";
import { html } from "../core/html.js";

/** @typedef {import("../core/folds.js").Fold} Id */

/** isWanted: open though nobody asked for it, for what is at work is in it.
 * @param {{ id: Id, title: string, value?: any, isWanted?: boolean, children?: any }} props */
export function Fold({ id, title, value, isWanted = false, children }) {
  const isOpen = isWanted || isUnfolded(id);
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
