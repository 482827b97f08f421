// Warnings and refusals: what is wrong, its fix, and buttons that apply it.
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { fixesOf } from "../warning_fixes.js";

const SHOWN = 2; // the others open on demand, so that the figures stay in sight

/**
 * Buttons for what can be done.
 * @param {{ trouble: { reason?: string, feature?: string | null, index?: number | null } }} props
 */
export function Fixes({ trouble }) {
  const fixes = fixesOf(trouble);
  return (
    fixes.length > 0 &&
    html`<div class="line">
      ${fixes.map(
        ({ label, test, run, waits }) =>
          html`<button key=${test} type="button" data-testid=${test} disabled=${waits} onClick=${run}>
          ${label}
        </button>`,
      )}
    </div>`
  );
}

/**
 * canFix: whether the clicks that it speaks of are those on the stage.
 * @param {{ warnings: import("../../../core/types").Warning[], canFix: boolean }} props
 */
export function Warnings({ warnings, canFix }) {
  const item = (/** @type {import("../../../core/types").Warning} */ w) =>
    html`<li key=${w.reason + w.feature + w.index + w.text} data-reason=${w.reason}>
      <b>${w.text}</b> ${w.fix}
      ${canFix && html`<${Fixes} trouble=${w} />`}
    </li>`;
  return html`
    <ul class="warnings" data-testid="warnings">
      ${warnings.slice(0, SHOWN).map(item)}
    </ul>
    ${
      warnings.length > SHOWN &&
      html`<details class="more">
      <summary>${t("calibrate.warnings.more", { count: warnings.length - SHOWN })}</summary>
      <ul class="warnings">${warnings.slice(SHOWN).map(item)}</ul>
    </details>`
    }
  `;
}
