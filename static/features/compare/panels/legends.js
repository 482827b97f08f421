// Legends of a comparison: the grid's spacing, and which picture is shown while blinking.
import { ACTIONS, run } from "../../../core/actions.js";
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { RATES, blink, hold, prefersLessMotion, setSwapRate } from "../blink.js";
import { comparedVersion, mode, visiblePicture } from "../comparison.js";
import { grid, gridLines, spacing, spacings } from "../grid.js";

/** While the grid is shown. */
export function GridLegend() {
  if (!grid.value.on || !comparedVersion.value) return null;
  const chosen = grid.value.spacing_mm,
    choose = (/** @type {string} */ text) => {
      grid.value = { ...grid.value, spacing_mm: text ? Number(text) : null };
    };
  return html`<section
    class="legend narrow"
    data-testid="grid-legend"
    aria-label=${t("compare.grid.legend")}
    title=${t("compare.grid.explained")}
  >
    <h2>${t("compare.grid.heading", { spacing: number(spacing.value, 0) })}</h2>
    <label class="choose">
      <span class="sr">${t("compare.grid.spacing")}</span>
      <select
        data-testid="grid-spacing"
        value=${chosen === null ? "" : String(chosen)}
        onChange=${(/** @type {any} */ e) => choose(e.target.value)}
      >
        <option value="">${t("compare.auto")}</option>
        ${spacings.value.map(
          (mm) => html`<option key=${mm} value=${String(mm)}>
          ${number(mm, 0)} mm
        </option>`,
        )}
      </select>
    </label>
    ${!gridLines.value && html`<p class="dim">${t("compare.grid.computing")}</p>`}
  </section>`;
}

/** While the pictures take turns. */
export function BlinkLegend() {
  if (mode.value !== "blink" || !comparedVersion.value) return null;
  const { running, rate } = blink.value,
    name = visiblePicture.value === "raw" ? t("common.raw") : t("common.corrected");
  return html`<section
    class="legend narrow"
    data-testid="blink-legend"
    data-showing=${visiblePicture.value}
    aria-label=${t("common.blink")}
  >
    <h2 class="showing">${name}</h2>
    ${
      prefersLessMotion.value
        ? html`<p data-testid="calm">${t("compare.blink.by-hand")}</p>`
        : html`<div class="switch" role="group" aria-label=${t("compare.blink.rate")}>
        <button
          type="button"
          data-testid="blink-pause"
          aria-pressed=${String(!running)}
          onClick=${() => run("blink-pause")}
        >
          ${t("compare.action.blink-pause.short")}
        </button>
        ${RATES.map(
          (r) => html`<button
          key=${r}
          type="button"
          data-testid=${`blink-${r}`}
          aria-pressed=${String(running && rate === r)}
          onClick=${() => setSwapRate(r)}
        >
          ${r}/s
        </button>`,
        )}
      </div>`
    }
    <div class="switch">
      <button type="button" data-testid="blink-swap" onClick=${() => run("swap")}>
        ${t("compare.action.swap.short")}
      </button>
      <button
        type="button"
        data-testid="blink-hold"
        title=${t("compare.blink.hold-action", { action: ACTIONS.get("flip")?.label ?? "" })}
        onPointerDown=${(/** @type {PointerEvent} */ e) => hold(e)}
      >
        ${t("compare.blink.hold")}
      </button>
    </div>
  </section>`;
}
