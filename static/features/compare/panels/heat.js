// The legend of the heat map: its scale, its figures, what else it can show, and why there is none.
import { ACTIONS, run } from "../../../core/actions.js";
import { dayAndTime, mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { modelTitle } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { rich } from "../../../ui/rich.js";
import { MapScale } from "../../../ui/map_scale.js";
import { Title } from "../../../ui/title.js";
import { goToModelComparison, worstPlaceFix } from "../../calibrate/warning_fixes.js";
import {
  comparableVersions,
  differenceFrom,
  hatMm,
  heat,
  isMapWanted,
  mapRefusal,
  shownMap,
} from "../heat.js";
import { arrows } from "../residual_arrows.js";
import { version, versions } from "../../versions/versions.js";

/** On the stage, while a map is wanted. */
export function HeatLegend() {
  if (!isMapWanted.value) return null;
  const { what } = heat.value,
    map = shownMap.value,
    why = mapRefusal.value;
  return html`<section class="legend" data-testid="legend" aria-label=${t("compare.heat.legend")}>
    <h2>
      ${
        what === "expected"
          ? t("common.expected-error")
          : t("compare.heat.difference", {
              version: version.value?.version ?? "–",
              other: numberOf(heat.value.other),
            })
      }
    </h2>
    ${map && html`<${MapScale} />`}
    ${
      why
        ? html`<p data-testid="no-map">
        <b>${why.detail}</b> ${why.fix}${" "}
        <button type="button" data-testid="no-map-cure" onClick=${goToModelComparison}>
          ${t("compare.heat.compare-models")}
        </button>
      </p>`
        : !map && html`<p class="dim">${t("compare.heat.computing")}</p>`
    }
    ${
      what === "expected" &&
      html`<div class="switch" role="group" aria-label=${t("compare.heat.where")}>
      <${Height} atHats=${false} label=${t("common.carpet")} />
      <${Height} atHats=${true} label=${t("compare.heat.hats", { height: hatMm.value })} />
    </div>`
    }
  </section>`;
}

/** @param {{ atHats: boolean, label: string }} props */
const Height = ({ atHats, label }) => html`<button
  type="button"
  data-testid=${`height-${atHats ? "hats" : "carpet"}`}
  aria-pressed=${heat.value.atHats === atHats}
  onClick=${() => {
    if (heat.value.atHats !== atHats) run("heat-height");
  }}
>
  ${label}
</button>`;

/** In the compare step: what can be laid over the picture, with its figures. */
export function HeatPanel() {
  const { what } = heat.value,
    map = shownMap.value,
    before = comparableVersions.value;
  return html`<section aria-label=${t("compare.heat.panel")}>
    <${Title} of="map">${t("compare.heat.panel")}<//>
    <div class="line">
      <${ActionButton}
        id="heat"
        label=${what === "expected" ? t("compare.heat.hide-expected") : t("compare.heat.show-expected")}
      />
      <${ActionButton}
        id="arrows"
        label=${arrows.value.on ? t("compare.heat.hide-arrows") : t("compare.heat.show-arrows")}
      />
    </div>
    ${
      map?.what === "expected" &&
      html`
      <p class="reason" data-testid="heat-figures">
        ${
          map.z_mm
            ? rich("compare.heat.figures.hats", {
                height: map.z_mm,
                median: mm(map.median_mm),
                worst: mm(map.worst_mm),
                place: place(map.worst_place),
              })
            : rich("compare.heat.figures.carpet", {
                median: mm(map.median_mm),
                worst: mm(map.worst_mm),
                place: place(map.worst_place),
              })
        }
      </p>
      <${Worst} />
    `
    }
    ${
      before.length > 0 &&
      html`<label class="pair tall other">
      <span>${t("compare.heat.difference-from")}</span>
      <select
        data-testid="other"
        value=${what === "difference" ? heat.value.other : ""}
        onChange=${(/** @type {any} */ e) =>
          e.target.value ? differenceFrom(e.target.value) : run("difference")}
      >
        <option value="">
          ${what === "difference" ? t("compare.heat.hide-difference") : ACTIONS.get("difference")?.short}
        </option>
        ${before.map(
          (v) => html`<option key=${v.id} value=${v.id}>
          ${t("compare.heat.version", {
            version: v.version,
            model: modelTitle(v.model.name),
            time: dayAndTime(v.created_at),
          })}
        </option>`,
        )}
      </select>
    </label>`
    }
    ${
      map?.what === "difference" &&
      html`
      <p class="reason" data-testid="heat-figures">
        ${rich("compare.heat.figures.difference", {
          median: mm(map.median_mm),
          worst: mm(map.worst_mm),
          place: place(map.worst_place),
          rms: number(map.rms_px, 2),
          max: number(map.max_px, 2),
        })}
      </p>
      <${Worst} />
    `
    }
  </section>`;
}

/** The worst place: to it, and what to do there. */
function Worst() {
  const { text, fixes } = worstPlaceFix();
  return html`<div class="worst-cure" data-testid="worst-cure">
    ${text && html`<p class="reason">${text}</p>`}
    <div class="line">
      <${ActionButton} id="worst-place" />
      ${fixes.map(
        (
          fix,
        ) => html`<button key=${fix.test} type="button" data-testid=${fix.test} onClick=${fix.run}>
        ${fix.label}
      </button>`,
      )}
    </div>
  </div>`;
}

/** @param {import("../../../core/types").Point} place */
const place = ([x, y]) => `${number(x, 0)}, ${number(y, 0)} mm`;

/** @param {string | null} id */
const numberOf = (id) => versions.value.find((v) => v.id === id)?.version ?? "–";
