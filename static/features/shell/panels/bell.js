// The bell: how many problems there are, and the list of them, each with the way to what mends it.
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { noProblem, problems, summary } from "../problems.js";

export function Bell() {
  const all = problems.value,
    { count, level: worst } = summary.value;
  return html`
    <button
      type="button"
      class="round bell"
      data-testid="bell"
      data-level=${worst}
      aria-haspopup="dialog"
      onClick=${() => list()?.showModal()}
      aria-label=${count ? t("shell.problems.count", { count }) : noProblem.value}
      title=${t("shell.problems.title")}
    >
      <svg width="18" height="18" viewBox="0 0 24 24" aria-hidden="true">
        <path
          fill="none"
          stroke="currentColor"
          stroke-width="1.8"
          stroke-linejoin="round"
          d="M5 17h14l-2-3v-4a5 5 0 0 0-10 0v4zM10 20a2 2 0 0 0 4 0"
        />
      </svg>
      ${count > 0 && html`<span aria-hidden="true">${count}</span>`}
    </button>
    <dialog
      id="problems"
      class="problems"
      data-testid="problems"
      aria-labelledby="problems-title"
      onClick=${(/** @type {Event} */ e) => {
        if (e.target === e.currentTarget) close(); // beside it
      }}
    >
      <div class="in">
        <h2 id="problems-title">${count ? t("shell.problems.title") : noProblem.value}</h2>
        <ul>
          ${all.map(
            ({
              id,
              level,
              text,
              fix,
              href,
            }) => html`<li key=${id} data-level=${level} data-testid="problem">
            <p>
              <b>${text}</b> ${fix}
            </p>
            ${href && html`<a href=${href} onClick=${close}>${t("common.show-it")}</a>`}
          </li>`,
          )}
        </ul>
      </div>
    </dialog>
  `;
}

const list = () => /** @type {HTMLDialogElement | null} */ (document.getElementById("problems"));
const close = () => list()?.close();
