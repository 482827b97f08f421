// Every model on the same points: error inside the field, number of parameters, and a verdict in words.
import { computed, signal } from "@preact/signals";
import { doc } from "../../../core/document.js";
import { mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { modelName, models } from "../../../core/state.js";
import { inWords } from "../../../core/statements.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { rich } from "../../../ui/rich.js";
import { comparison, isFresh, notCompared, ranking, useModel } from "../model_ranking.js";
import { LEVEL } from "./levels.js";

/**
 * @typedef {import("../../../core/types").Ranked} Ranked
 * @typedef {"title" | "field_mm" | "parameters"} Column
 */

/** @type {{ id: Column, label: string, title: string }[]} */
const COLUMNS = [
  {
    id: "title",
    label: t("calibrate.model-table.model"),
    title: t("calibrate.model-table.sort.model"),
  },
  {
    id: "field_mm",
    label: t("calibrate.model-table.error"),
    title: t("calibrate.model-table.sort.error"),
  },
  {
    id: "parameters",
    label: t("calibrate.model-table.parameters"),
    title: t("calibrate.model-table.sort.parameters"),
  },
];

/** By which column; up: the smallest first. */
const NO_DISTORTION = { code: "comparison.no-distortion" }; // told apart, above the reason
const order = signal(/** @type {{ by: Column, up: boolean }} */ ({ by: "field_mm", up: true }));

/** Models with their figures, in the order that is wished; those without a figure last. */
const rows = computed(() => {
  const known = new Map(ranking.value?.ranking.map((r) => [r.model, r]) ?? []),
    { by, up } = order.value;
  const fitted = models.value.filter((m) => m.is_fitted);
  const all = fitted.map((m) => ({
    name: m.name,
    title: m.title,
    it: known.get(m.name),
    failed: ranking.value?.failed.find((f) => f.model === m.name),
  }));
  return all.toSorted((a, b) => {
    if (by === "title") return (up ? 1 : -1) * a.title.localeCompare(b.title);
    const [x, y] = [a.it?.[by] ?? null, b.it?.[by] ?? null];
    if (x === null || y === null) return Number(x === null) - Number(y === null);
    return (up ? 1 : -1) * (x - y);
  });
});

export function ModelTable() {
  const { by, up } = order.value;
  return html`<section aria-label=${t("calibrate.model-table.title")}>
    <h2>${t("calibrate.model-table.heading")}</h2>
    <${Comparing} />
    <${Conclusion} />
    <table class=${`models${ranking.value && !isFresh() ? " stale" : ""}`} data-testid="models">
      <thead>
        <tr>
          ${COLUMNS.map(
            ({ id, label, title }) =>
              html`<th key=${id} scope="col" aria-sort=${by === id ? (up ? "ascending" : "descending") : "none"}>
              <button
                type="button"
                title=${title}
                data-testid=${`sort-${id}`}
                onClick=${() => {
                  order.value = { by: id, up: by === id ? !up : true };
                }}
              >
                ${label}
                <i aria-hidden="true">${by === id ? (up ? "▴" : "▾") : ""}</i>
              </button>
            </th>`,
          )}
        </tr>
      </thead>
      ${rows.value.map((row) => html`<${Row} key=${row.name} ...${row} />`)}
    </table>
  </section>`;
}

/** One model: what it would miss, or why it cannot be had. @param {typeof rows.value[number]} props */
function Row({ name, title, it, failed }) {
  const isOn = modelName.value === name,
    isBest = name === ranking.value?.recommended;
  return html`<tbody class=${isOn ? "now" : ""} data-row=${name}>
    <tr>
      <th scope="row">
        <button
          type="button"
          aria-pressed=${String(isOn)}
          data-testid=${`model-${name}`}
          title=${isOn ? t("calibrate.model-table.is-used") : t("calibrate.model-table.use", { model: title })}
          onClick=${() => useModel(name)}
        >
          <i class="dot" aria-hidden="true">
            ${isOn ? "●" : "○"}
          </i>
          ${title}
        </button>
      </th>
      <td class="value">
        ${
          it
            ? html`
            ${mm(it.field_mm)}
            <small> mm</small>
          `
            : failed
              ? "–"
              : ""
        }
      </td>
      <td>${it ? it.parameters : ""}</td>
    </tr>
    ${
      it &&
      html`<tr class="words">
      <td colspan="3">
        <b class=${`level ${it.verdict.level}`}>${LEVEL[it.verdict.level]}</b>
        ${
          isBest &&
          html`
          , <b class="recommended">${t("calibrate.model-table.recommended")}</b>
        `
        }
      </td>
    </tr>`
    }
    ${
      failed &&
      html`<tr class="words">
      <td colspan="3" data-testid=${`failed-${name}`}>
        <b class="level fair">${t("calibrate.model-table.cannot-be-fitted")}</b> ${failed.what} ${failed.fix}
      </td>
    </tr>`
    }
    ${
      isOn &&
      it &&
      html`<tr class="words">
      <td colspan="3">
        <dl class="reason details" data-testid="model-details">
          ${details(it).map(
            ([what, value]) => html`<div key=${what}>
            <dt>${what}</dt>
            <dd>${value}</dd>
          </div>`,
          )}
        </dl>
      </td>
    </tr>`
    }
  </tbody>`;
}

/** What the one figure is made of. @param {Ranked} row @returns {[string, string][]} */
const details = (row) =>
  /** @type {[string, string, number | null][]} */ ([
    [t("calibrate.model-table.held-out"), `${mm(row.held_out_mm)} mm`, row.held_out_mm],
    [t("calibrate.model-table.unused-clicks"), `${mm(row.check_mm)} mm`, row.check_mm],
    [t("calibrate.model-table.from-best"), `${mm(row.apart_mm)} mm`, row.apart_mm],
    [t("calibrate.model-table.expected-carpet"), `${mm(row.expected_mm)} mm`, row.expected_mm],
    [
      row.hat_height_mm
        ? t("calibrate.model-table.expected-hat-height", { height: row.hat_height_mm })
        : t("calibrate.model-table.expected-hat"),
      `${mm(row.expected_hat_mm)} mm`,
      row.expected_hat_mm,
    ],
    [t("calibrate.model-table.residual"), `${number(row.rms_px, 2)} px`, row.rms_px],
  ])
    .filter(([, , value]) => value !== null)
    .map(([what, value]) => [what, value]);

/** How far the comparison is, or how to begin it again. */
export function Comparing() {
  const now = comparison.value,
    why = notCompared.value?.why;
  if (now)
    return html`<div class="working" data-testid="comparing">
      <div class="line">
        <progress max="1" value=${now.progress} aria-label=${t("calibrate.model-table.progress")}></progress>
        <${ActionButton} id="stop-comparing" />
      </div>
      <p class="reason">${now.message || t("calibrate.model-table.comparing")}</p>
    </div>`;
  if (!notCompared.value) return null;
  return html`<div class="working" data-testid="not-compared">
    <p class="reason">
      ${
        why
          ? html`
          <b>${why.detail}</b> ${why.fix}
        `
          : t("calibrate.model-table.not-compared")
      }
    </p>
    <${ActionButton} id="compare-models" />
  </div>`;
}

/** What the comparison says, in a sentence. */
function Conclusion() {
  const now = ranking.value;
  if (!now) return null;
  const best = models.value.find((m) => m.name === now.recommended),
    failed = now.failed.length;
  return html`
    ${
      now.no_significant_distortion &&
      html`<p class="plainly" data-testid="no-distortion">
      ${rich("calibrate.model-table.no-distortion")}
    </p>`
    }
    <p class=${isFresh() ? "reason" : "reason stale"} data-testid="ranking">
      ${
        best &&
        html`
        <b>${t("calibrate.model-table.recommended-model")}</b>${" "}
      `
      }
      ${now.reason.replace(`${inWords(NO_DISTORTION) ?? "No significant distortion."} `, "")}
      ${failed > 0 && ` ${t("calibrate.model-table.failed", { count: failed })}`}
    </p>
    ${
      best &&
      doc.value.model !== null &&
      best.name !== doc.value.model &&
      html`<div class="line use">
      <${ActionButton} id="use-recommended" label=${t("calibrate.model-table.use", { model: best.title })} />
    </div>`
    }
  `;
}
