// How far long work is, the button that stops it, and why it was refused.
import { html } from "../core/html.js";
import { t } from "../core/words.js";
import { ActionButton } from "./action_button.js";

/**
 * @param {{ now: { progress: number, message: string } | null, what: string, stop: string, why:
 * import("../core/types").Refusal | null, name: string }} props name: what tests call the refusal
 */
export const Working = ({ now, what, stop, why, name }) => html`
  ${
    now &&
    html`<div class="working" data-testid="finding">
    <div class="line">
      <progress max="1" value=${now.progress} aria-label=${what}></progress>
      <${ActionButton} id=${stop} />
    </div>
    <p class="reason">${now.message || t("common.asking")}</p>
  </div>`
  }
  ${
    why &&
    html`<div class="warning-line" role="alert" data-testid=${`${name}-refusal`}>
    <b>${why.detail}</b> ${why.fix}
  </div>`
  }
`;
