// Files for other programs: every format with what it holds, and what this version loses in it.
import { address } from "../../../core/api.js";
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { askFormats, formats } from "../exports.js";

const ELSEWHERE = new Set(["json", "npz"]); // they stand above, among the downloads for everybody

/** @param {{ it: import("../../../core/types").Calibration }} props */
export function ExportMenu({ it }) {
  const known =
    formats.value?.id === it.id
      ? formats.value.items.filter((f) => !ELSEWHERE.has(f.format))
      : null;
  return html`<details
    class="more"
    data-testid="exports"
    onToggle=${(/** @type {any} */ e) => e.target.open && void askFormats(it.id)}
  >
    <summary>${t("versions.export.title")}</summary>
    ${
      known === null
        ? html`<p class="dim">${t("versions.export.asking")}</p>`
        : html`
        <ul class="plain downloads exports">
          ${known.map(
            (f) => html`<li key=${f.format}>
            ${
              f.problem
                ? html`<b>${f.title}</b>`
                : html`<a data-testid=${`export-${f.format}`} href=${link(it.id, f)} download>
                ${f.title}
              </a>`
            }
            <em class=${f.exact && !f.problem ? "dim" : "approximate"} data-testid=${`cost-${f.format}`}>
              ${cost(f)}
            </em>
            <small>${f.problem ? f.problem.fix : f.holds}</small>
          </li>`,
          )}
        </ul>
        <p class="dim">
          ${t("versions.export.errors")}
        </p>
      `
    }
  </details>`;
}

/** @param {string} id @param {import("../../../core/types").Format} f */
const link = (id, f) =>
  address(`/calibrations/${id}/export/${f.format}${f.exact ? "" : "?approximate=true"}`);

/** @param {import("../../../core/types").Format} f */
function cost(f) {
  if (f.problem) return t("versions.export.cannot");
  if (f.loss === null || Math.max(f.loss.worst_mm, f.loss.hat_worst_mm ?? 0) < 0.005)
    return f.exact ? t("versions.export.exact") : "0.00 mm";
  const worst = number(f.loss.worst_mm, 2);
  return f.loss.hat_worst_mm === null
    ? `${worst} mm`
    : t("versions.export.cost-hat", { worst, hat: number(f.loss.hat_worst_mm, 2) });
}
