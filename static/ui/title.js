// A panel's heading, and the way to the place in the manual that explains it.
import { html } from "../core/html.js";
import { EXPLAINED, openManual } from "../core/manual.js";
import { t } from "../core/words.js";

/**
 * of: which panel, as the manual's table names it. about: what is explained, if the heading itself is a figure or a
 * date. value: a figure at the end of the line.
 * @param {{ of: string, about?: string, value?: string, children?: any }} props */
export const Title = ({ of, about, value, children }) => html`<div class="titled">
  <h2>${children}</h2>
  ${value && html`<em>${value}</em>`}
  <button
    type="button"
    class="ask"
    data-testid=${`explain-${of}`}
    aria-label=${t("ui.title.explain", { what: about ?? [children].flat().join("") })}
    title=${t("ui.title.explain-this")}
    onClick=${() => void openManual(EXPLAINED[of])}
  >
    ?
  </button>
</div>`;
