// Whether what the operator did is saved, and where.
import { signal } from "@preact/signals";
import { online } from "../../../core/api.js";
import { ago } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { route } from "../../../core/route.js";
import { draft } from "../../calibrate/draft.js";
import { both } from "../../pair/pair.js";

const now = signal(Date.now());
setInterval(() => {
  now.value = Date.now();
}, 1000);

export function Saved() {
  const { state, at } = draft.value;
  if (state === "none")
    return (
      route.value.view === "pair" &&
      both.value &&
      html`<span class="saved" data-testid="kept">Kept in this browser</span>`
    );
  const text =
    !online.value || state === "away"
      ? "Kept in this browser"
      : state === "saved"
        ? `Saved ${ago(at, now.value)}`
        : state === "unsaved"
          ? "Saving…"
          : "Not saved";
  return html`<span class=${`saved ${state}`} data-testid="saved" data-state=${state}>
    ${text}
  </span>`;
}
