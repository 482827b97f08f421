// Bottom of the page: what needs attention, which version stands, jobs, the keys that matter now, and dark or light.
import { clock, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { route } from "../../../core/route.js";
import { snapshot, step } from "../../../core/state.js";
import { THEMES, chooseTheme, theme } from "../../../core/theme.js";
import { JobsIndicator } from "../../jobs/panels/jobs.js";
import { problems } from "../problems.js";
import { isSaved, version } from "../../versions/versions.js";

/** @type {Record<string, [string, string][]>} */
const KEYS = {
  "": [
    ["O", "open a picture"],
    ["?", "all keys"],
  ],
  field: [
    ["T", "rotate the field 90°"],
    ["Enter", "continue"],
    ["?", "all keys"],
  ],
  points: [
    ["click", "add"],
    ["drag", "move"],
    ["Alt", "no snap"],
    ["←↑→↓", "nudge"],
    ["F", "find points"],
    ["Ctrl Z", "undo"],
    ["?", "all keys"],
  ],
  verify: [
    ["R", "raw"],
    ["W", "wipe"],
    ["C", "corrected"],
    ["S", "side"],
    ["K", "blink"],
    ["L", "lines"],
    ["G", "grid"],
    ["E", "error"],
    ["?", "all keys"],
  ],
  pair: [
    ["click", "left, then right"],
    ["drag", "move"],
    ["←↑→↓", "nudge"],
    ["N", "next"],
    ["X", "worst"],
    ["S", "lines"],
    ["Ctrl Z", "undo"],
    ["?", "all keys"],
  ],
};

/** The worst problem, with the way to what mends it; or that there is none. */
function Health() {
  const all = problems.value,
    [worst] = all,
    more = all.length - 1;
  if (!worst) return html`<span data-testid="status" data-level="ok"><i aria-hidden="true">✓</i> No problems</span>`;
  return html`<span class="status" data-testid="status" data-level=${worst.level} role="status">
    <i aria-hidden="true">▲</i> <b>${worst.text}</b>${" "}
    ${worst.href && html`<a href=${worst.href}>Fix</a>`}
    ${more > 0 && html`<small>${` and ${plural(more, "other")}`}</small>`}
  </span>`;
}

export function StatusBar() {
  const it = version.value;
  return html`<footer>
    <${Health} />
    <span class="standing" data-testid="version">
      ${it
        ? html`
          <b>Version ${it.version}</b> ${it.active ? "active" : "saved"} at ${clock(it.created_at)}
          ${isSaved.value ? "" : ", clicks changed since"}
        `
        : snapshot.value
        ? (
        "No calibration saved from this picture yet"
      )
        : null}
    </span>
    <${JobsIndicator} />
    <span class="hints">
      ${KEYS[route.value.view === "pair" ? "pair" : step.value].map(([key, what]) => html`<span key=${key}>
        <kbd>${key}</kbd> ${what}
      </span>`)}
    </span>
    <label class="theme">
      <span>Colours</span>
      <select
        data-testid="theme"
        value=${theme.value}
        onChange=${(/** @type {any} */ e) => chooseTheme(e.target.value)}
      >
        ${THEMES.map(([id, label]) => html`<option key=${id} value=${id}>
          ${label}
        </option>`)}
      </select>
    </label>
  </footer>`;
}
