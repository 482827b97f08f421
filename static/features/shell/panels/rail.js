// The rail: the five places, and help at its foot.
import { run } from "../../../core/actions.js";
import { html } from "../../../core/html.js";
import { addressOf, route } from "../../../core/route.js";
import { help } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { PLACES } from "../places.js";
import { summaryOfPlace } from "../problems.js";

export const Rail = () => html`<nav class="rail" aria-label=${t("shell.rail.title")}>
  <a class="brand" href=${addressOf("wall")} aria-label=${t("shell.rail.brand")} tabindex="-1">
    <${Icon} path="M3 3Q6 12 3 21M21 3Q18 12 21 21M3 3Q12 6 21 3M3 21Q12 18 21 21" />
  </a>
  <ul>
    ${PLACES.map(
      ({ place, view, label, icon }) => html`<li key=${place}>
      <a
        href=${addressOf(view)}
        data-testid=${`rail-${place}`}
        aria-current=${route.value.place === place ? "page" : undefined}
      >
        <${Icon} path=${icon} />
        ${label}
        <${Dot} of=${place} />
      </a>
    </li>`,
    )}
  </ul>
  <button
    type="button"
    data-testid="help"
    aria-expanded=${help.value !== ""}
    onClick=${() => run(help.value ? "escape" : "manual")}
  >
    <${Icon} path="M9 9.5a3 3 0 1 1 4.5 2.6c-1 .6-1.5 1-1.5 2.2M12 17.5v.2" />
    ${t("shell.rail.help")}
  </button>
</nav>`;

/** How much needs attention there. @param {{ of: string }} props */
function Dot({ of }) {
  const { count, level } = summaryOfPlace(of);
  return (
    count > 0 &&
    html`<i class="dot" data-level=${level} data-testid=${`dot-${of}`}>
    <span aria-hidden="true">${count}</span>
    <span class="sr">, ${t("shell.problems.count", { count })}</span>
  </i>`
  );
}

/** @param {{ path: string }} props */
const Icon = ({ path }) => html`<svg width="22" height="22" viewBox="0 0 24 24" aria-hidden="true">
  <path
    fill="none"
    stroke="currentColor"
    stroke-width="1.7"
    stroke-linecap="round"
    stroke-linejoin="round"
    d=${path}
  />
</svg>`;
