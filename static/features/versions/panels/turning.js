// Turns a version with its camera's images.
import { html } from "../../../core/html.js";
import { busy } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { TURNS, turnVersion } from "../turning.js";

/** @param {{ it: { id: string, version: number } }} props */
export function TurnMenu({ it }) {
  return html`<details class="more" data-testid="turn">
    <summary>${t("versions.turn")}</summary>
    <p class="dim">${t("versions.turn.how")}</p>
    <div class="line wrap" role="group" aria-label=${t("versions.turn.of", { version: it.version })}>
      ${TURNS.map(
        ({ degrees, label }) => html`<button
        key=${degrees}
        type="button"
        data-testid=${`turn-${degrees}`}
        disabled=${busy.value !== ""}
        onClick=${() => void turnVersion(it, degrees)}
      >
        ${label}
      </button>`,
      )}
    </div>
  </details>`;
}
