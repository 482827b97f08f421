// Whether what the operator did is saved, and where.
import { signal } from "@preact/signals";
import { online } from "../../../core/api.js";
import { ago } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { route } from "../../../core/route.js";
import { t } from "../../../core/words.js";
import { draft } from "../../calibrate/draft.js";
import { both } from "../../rigs/match_desk.js";

const now = signal(Date.now());
setInterval(() => {
  now.value = Date.now();
}, 1000);

export function Saved() {
  const { state, at } = draft.value;
  if (state === "none")
    return (
      route.value.view === "match" &&
      both.value &&
      html`<span class="saved" data-testid="kept">${t("shell.saved.in-browser")}</span>`
    );
  const text =
    !online.value || state === "away"
      ? t("shell.saved.in-browser")
      : state === "saved"
        ? t("shell.saved.when", { when: ago(at, now.value) })
        : state === "unsaved"
          ? t("shell.saved.saving")
          : t("shell.saved.not");
  return html`<span class=${`saved ${state}`} data-testid="saved" data-state=${state}>
    ${text}
  </span>`;
}
