// The tabs of a place, or of a camera.
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { tabs } from "../places.js";

export const Tabs = () =>
  tabs.value.length > 0 &&
  html`<nav class="page-tabs" aria-label=${t("shell.tabs.title")}>
    ${tabs.value.map(
      ({ view, label, href, isShown }) => html`<a
      key=${view}
      href=${href}
      data-testid=${`tab-${view}`}
      aria-current=${isShown ? "page" : undefined}
    >
      ${label}
    </a>`,
    )}
  </nav>`;
