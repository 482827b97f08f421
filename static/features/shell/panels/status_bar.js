// Bottom of the page: what needs attention, what is saved, jobs, the keys that matter now, and dark or light.
import { html } from "../../../core/html.js";
import { keyLabel } from "../../../core/keys.js";
import { route } from "../../../core/route.js";
import { snapshot, step } from "../../../core/state.js";
import { THEMES, chooseTheme, theme } from "../../../core/theme.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { JobsIndicator } from "../../jobs/panels/jobs.js";
import { noProblem, summary } from "../problems.js";
import { isSaved, version } from "../../versions/versions.js";
import { Saved } from "./saved.js";

/** The keys of a step; the bar draws as many as find room. @type {Record<string, [string, string][]>} */
const KEYS = {
  "": [["O", t("shell.keys.open")]],
  field: [
    ["T", t("shell.keys.rotate")],
    ["Enter", t("shell.keys.continue")],
  ],
  points: [
    [t("shell.keys.click"), t("shell.keys.add")],
    [t("shell.keys.drag"), t("shell.keys.move")],
    ["Alt", t("shell.keys.no-snap")],
    ["←↑→↓", t("shell.keys.nudge")],
    ["F", t("shell.keys.find-points")],
    [keyLabel("ctrl+z"), t("shell.keys.undo")],
  ],
  verify: [
    ["R", t("shell.keys.raw")],
    ["W", t("shell.keys.wipe")],
    ["C", t("shell.keys.corrected")],
    ["S", t("shell.keys.side")],
    ["K", t("shell.keys.blink")],
    ["L", t("shell.keys.lines")],
    ["G", t("shell.keys.grid")],
    ["E", t("shell.keys.error")],
  ],
  match: [
    [t("shell.keys.click"), t("shell.keys.left-right")],
    [t("shell.keys.drag"), t("shell.keys.move")],
    ["←↑→↓", t("shell.keys.nudge")],
    ["N", t("shell.keys.next")],
    ["X", t("shell.keys.worst")],
    [keyLabel("ctrl+z"), t("shell.keys.undo")],
  ],
};

/** @type {[string, string]} */
const ALL = ["?", t("shell.keys.all")];

/** The worst problem, with the way to what mends it; or that there is none. */
function Health() {
  const { count, level, worst } = summary.value,
    more = count - 1;
  if (!worst)
    return html`<span data-testid="status" data-level=${level}>
      ${level === "ok" && html`<i aria-hidden="true">✓</i>`} ${noProblem.value}
    </span>`;
  return html`<span class="status" data-testid="status" data-level=${level} role="status">
    <i aria-hidden="true">▲</i> <b title=${worst.text}>${worst.text}</b>${" "}
    ${worst.href && html`<a href=${worst.href}>${t("shell.status.fix")}</a>`}
    ${more > 0 && html`<small>${` ${t("shell.status.more", { count: more })}`}</small>`}
  </span>`;
}

export function StatusBar() {
  const it = version.value,
    keys = [ALL, ...KEYS[route.value.view === "match" ? "match" : step.value]];
  return html`<footer>
    <${Health} />
    <${Saved} />
    <span class="standing" data-testid="version">
      ${
        it
          ? html`
          ${rich(it.active ? "shell.status.version-active" : "shell.status.version-saved", {
            version: it.version,
          })}
          ${isSaved.value ? "" : t("shell.status.draft-differs")}
        `
          : snapshot.value
            ? t("shell.status.no-version")
            : null
      }
    </span>
    <${JobsIndicator} />
    <span class="hints">
      ${keys.map(
        ([key, what]) => html`<span key=${key}>
        <kbd>${key}</kbd> ${what}
      </span>`,
      )}
    </span>
    <label class="theme">
      <span>${t("shell.status.colours")}</span>
      <select
        data-testid="theme"
        value=${theme.value}
        onChange=${(/** @type {any} */ e) => chooseTheme(e.target.value)}
      >
        ${THEMES.map(
          ([id, label]) => html`<option key=${id} value=${id}>
          ${label}
        </option>`,
        )}
      </select>
    </label>
  </footer>`;
}
