// Bottom of the page: which version stands, the keys that matter now, and dark or light.
import { clock } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { route } from "../../../core/route.js";
import { snapshot, step } from "../../../core/state.js";
import { THEMES, chooseTheme, theme } from "../../../core/theme.js";
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

export function Footer() {
  const it = version.value;
  return html`<footer>
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
        : (
        "Touchline works without the internet"
      )}
    </span>
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
