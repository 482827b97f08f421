// The list of pictures that a lens is found or judged by, the ways to add one.
import { ACTIONS, run } from "../../../core/actions.js";
import { html } from "../../../core/html.js";
import { cameras } from "../../../core/state.js";
import { t } from "../../../core/words.js";

/**
 * The list of pictures, and the ways to add one.
 * @param {{ of: string, name: string, add: string, count: number, busy: boolean, take: (camera: string) => unknown,
 * clear: () => void, children: any }} props
 */
export const Pictures = ({ of, name, add, count, busy, take, clear, children }) =>
  html`<section aria-label=${t("lens-pictures.list", { subject: of })}>
    <h2>
      ${t("lens-pictures.list-count", { count, subject: of })}
    </h2>
    <ul class="views" data-testid="views">
      ${children}
    </ul>
    <button type="button" class="drop" data-testid=${add} onClick=${() => run(add)}>
      <b>${ACTIONS.get(add)?.label}</b>
      <small>${t("lens-pictures.how-to-add")}</small>
    </button>
    <div class="line">
      ${cameras.value.map(
        ({ id, name: camera }) =>
          html`<button key=${id} type="button" data-testid=${`${name}-camera-${id}`} onClick=${() => void take(id)}>
          ${t("lens-pictures.take-one", { camera })}
        </button>`,
      )}
      ${
        count > 0 &&
        html`<button type="button" disabled=${busy} onClick=${clear}>
        ${t("lens-pictures.remove-all")}
      </button>`
      }
    </div>
  </section>`;
