// Files for other programs: every format with what it holds, and what this version loses in it.
import { address } from "../../../core/api.js";
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { askFormats, formats } from "../exports.js";

const ELSEWHERE = new Set(["json", "npz"]); // they stand above, among the downloads for everybody

/** @param {{ it: import("../../../core/types").Calibration }} props */
export function ExportMenu({ it }) {
  const known =
    formats.value?.id === it.id ? formats.value.items.filter((f) => !ELSEWHERE.has(f.format)) : null;
  return html`<details
    class="more"
    data-testid="exports"
    onToggle=${(/** @type {any} */ e) => e.target.open && void askFormats(it.id)}
  >
    <summary>For other programs</summary>
    ${known === null
      ? html`<p class="dim">Asking what each can hold…</p>`
      : html`
        <ul class="plain downloads exports">
          ${known.map((f) => html`<li key=${f.format}>
            ${f.problem
              ? html`<b>${f.title}</b>`
              : html`<a data-testid=${`export-${f.format}`} href=${link(it.id, f)} download>
                ${f.title}
              </a>`}
            <em class=${f.exact && !f.problem ? "dim" : "approximate"} data-testid=${`cost-${f.format}`}>
              ${cost(f)}
            </em>
            <small>${f.problem ? f.problem.fix : f.holds}</small>
          </li>`)}
        </ul>
        <p class="dim">
          Errors are against this version, at worst over its region: on the carpet, and at a robot's hat where
          it has rays.
        </p>
      `}
  </details>`;
}

/** @param {string} id @param {import("../../../core/types").Format} f */
const link = (id, f) => address(`/calibrations/${id}/export/${f.format}${f.exact ? "" : "?approximate=true"}`);

/** @param {import("../../../core/types").Format} f */
function cost(f) {
  if (f.problem) return "cannot";
  if (f.loss === null || Math.max(f.loss.worst_mm, f.loss.hat_worst_mm ?? 0) < 0.005)
    return f.exact ? "exact" : "0.00 mm";
  const hat = f.loss.hat_worst_mm === null ? "" : `, hat ${number(f.loss.hat_worst_mm, 2)}`;
  return `${number(f.loss.worst_mm, 2)} mm${hat}`;
}
