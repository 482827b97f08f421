// Legends of a comparison: the grid's spacing, and which picture is shown while blinking.
import { ACTIONS, run } from "../../../core/actions.js";
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
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
    aria-label="Grid"
    title="Straight on the corrected picture; as bent on the raw one as the lens bends."
  >
    <h2>Grid, ${number(spacing.value, 0)} mm</h2>
    <label class="choose">
      <span class="sr">Spacing of the grid</span>
      <select
        data-testid="grid-spacing"
        value=${chosen === null ? "" : String(chosen)}
        onChange=${(/** @type {any} */ e) => choose(e.target.value)}
      >
        <option value="">Auto</option>
        ${spacings.value.map((mm) => html`<option key=${mm} value=${String(mm)}>
          ${number(mm, 0)} mm
        </option>`)}
      </select>
    </label>
    ${!gridLines.value && html`<p class="dim">The server computes it…</p>`}
  </section>`;
}

/** While the pictures take turns. */
export function BlinkLegend() {
  if (mode.value !== "blink" || !comparedVersion.value) return null;
  const { running, rate } = blink.value,
    name = visiblePicture.value === "raw" ? "Raw" : "Corrected";
  return html`<section
    class="legend narrow"
    data-testid="blink-legend"
    data-showing=${visiblePicture.value}
    aria-label="Blink"
  >
    <h2 class="showing">${name}</h2>
    ${prefersLessMotion.value
      ? html`<p data-testid="calm">Less motion is wished: swap by hand.</p>`
      : html`<div class="switch" role="group" aria-label="Swaps a second">
        <button
          type="button"
          data-testid="blink-pause"
          aria-pressed=${String(!running)}
          onClick=${() => run("blink-pause")}
        >
          Pause
        </button>
        ${RATES.map((r) => html`<button
          key=${r}
          type="button"
          data-testid=${`blink-${r}`}
          aria-pressed=${String(running && rate === r)}
          onClick=${() => setSwapRate(r)}
        >
          ${r}/s
        </button>`)}
      </div>`}
    <div class="switch">
      <button type="button" data-testid="blink-swap" onClick=${() => run("swap")}>
        Swap
      </button>
      <button
        type="button"
        data-testid="blink-hold"
        title=${`Hold: ${ACTIONS.get("flip")?.label}`}
        onPointerDown=${(/** @type {PointerEvent} */ e) => hold(e)}
      >
        Hold
      </button>
    </div>
  </section>`;
}
