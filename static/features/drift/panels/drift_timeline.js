// The displacement of the last hours as a plot with what happened, and the same as a table.
import { useState } from "preact/hooks";
import { clock, mm } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { Fold } from "../../../ui/fold.js";
import { Plot, ink } from "../../../ui/canvas_plot.js";
import { displacement, rows } from "../displacement.js";
import { axesOf, largestOf } from "../timeline.js";

/** @typedef {import("../timeline.js").Row} Row @typedef {import("uplot")} UPlot */

const HEIGHT = 200,
  MINUTE = 60,
  GAP = 1.5; // entries: what is further apart was not measured between
const STEPS_S = [1, 2, 5, 10, 15, 30, 60, 120].map((minutes) => minutes * MINUTE);
/** What stands above the line of an event, and what it is called: the form differs as well as the colour. */
const KINDS = /** @type {const} */ ({
  activated: { mark: "◆", ink: "--accent", word: "drift.event.activated" },
  moved: { mark: "▲", ink: "--bad", word: "drift.event.moved" },
  cleared: { mark: "✓", ink: "--accent", word: "drift.event.cleared" },
  offline: { mark: "✕", ink: "--warn", word: "drift.event.offline" },
  back: { mark: "●", ink: "--accent", word: "drift.event.back" },
});

export function DriftTimeline() {
  const [at, point] = useState(-1),
    it = displacement.value,
    all = rows.value;
  if (!it || all.length === 0) return null;
  const { time, mm: span } = axesOf(all, it.moved_mm, it.entry_s),
    largest = largestOf(all);
  return html`<section class="drift-time" aria-label=${t("drift.time")} data-testid="drift-time">
    <h2>${t("drift.time")}</h2>
    <${Plot}
      of="drift"
      name="drift-plot"
      height=${HEIGHT}
      label=${t("drift.time.label")}
      data=${[all.map((row) => row.at), all.map((row) => row.mm)]}
      at=${all[at] ? at : -1}
      options=${options}
      draw=${(/** @type {UPlot} */ u) => draw(u, all, it.moved_mm, it.entry_s)}
      across=${time}
      span=${span}
      describe=${(/** @type {number} */ i) => (all[i] ? inWords(all[i]) : "")}
      isEmpty=${(/** @type {number} */ i) => !all[i].isStop}
      point=${point}
      take=${point}
    />
    <p class="reason" data-testid="drift-time-words">
      ${
        all[at]
          ? inWords(all[at])
          : largest
            ? t("drift.time.largest", { distance: mm(largest.mm), time: clock(1000 * largest.at) })
            : t("drift.time.not-measured")
      }
    </p>
    <ul class="drift-kinds">
      ${Object.entries(KINDS).map(
        ([kind, { mark, ink: of, word }]) => html`<li key=${kind}>
          <span aria-hidden="true" style=${`color:var(${of})`}>${mark}</span>${" "}${t(word)}
        </li>`,
      )}
    </ul>
    <${Fold} id="drift" title=${t("drift.table")}>
      <table class="drift-table" data-testid="drift-table">
        <thead>
          <tr>
            <th scope="col">${t("drift.table.time")}</th>
            <th scope="col">mm</th>
            <th scope="col">${t("drift.table.event")}</th>
          </tr>
        </thead>
        <tbody>
          ${all
            .filter((row) => row.isStop)
            .toReversed()
            .map(
              (row) => html`<tr key=${row.at}>
              <th scope="row">${clock(1000 * row.at)}</th>
              <td>${row.mm === null ? "–" : mm(row.mm)}</td>
              <td>${row.events.map(({ text }) => text).join(" ")}</td>
            </tr>`,
            )}
        </tbody>
      </table>
    <//>
  </section>`;
}

/** @param {number} px */
const fontOf = (px) => AXIS.font.replace("11", String(px));

/** @param {Row} row */
const inWords = ({ at, mm: far, events }) =>
  [
    far === null
      ? t("drift.time.none-at", { time: clock(1000 * at) })
      : t("drift.time.at", { time: clock(1000 * at), distance: mm(far) }),
    ...events.map(({ text }) => text),
  ].join(" ");

const options = () => ({
  axes: [
    {
      ...AXIS,
      labelFont: AXIS.font,
      label: t("drift.time.axis-time"),
      size: 24,
      incrs: STEPS_S,
      space: 56,
      values: (/** @type {UPlot} */ _u, /** @type {number[]} */ splits) =>
        splits.map((s) => clock(1000 * s)),
    },
    {
      ...AXIS,
      labelFont: AXIS.font,
      label: t("drift.time.axis-mm"),
      size: 40,
      values: (/** @type {UPlot} */ _u, /** @type {number[]} */ splits) =>
        splits.map((value) => mm(value)),
    },
  ],
});

const AXIS = {
  stroke: () => ink("--dim"),
  font: "11px system-ui, sans-serif",
  labelSize: 18,
  labelGap: 0,
  gap: 4,
  ticks: { show: false },
  grid: { stroke: () => ink("--line"), width: 1 },
};

/** @param {UPlot} u @param {Row[]} all @param {number} movedMm @param {number} entryS */
function draw(u, all, movedMm, entryS) {
  const g = u.ctx,
    ratio = devicePixelRatio,
    { left, top, width, height } = u.bbox;
  const x = (/** @type {number} */ at) => u.valToPos(at, "x", true),
    y = (/** @type {number} */ value) => u.valToPos(value, "y", true);
  g.save();
  g.beginPath();
  g.rect(left, top, width, height);
  g.clip();
  g.strokeStyle = g.fillStyle = ink("--bad");
  g.lineWidth = ratio;
  g.setLineDash([5 * ratio, 4 * ratio]);
  g.beginPath();
  g.moveTo(left, y(movedMm));
  g.lineTo(left + width, y(movedMm));
  g.stroke();
  g.setLineDash([]);
  g.font = fontOf(11 * ratio);
  g.textAlign = "left";
  g.textBaseline = "bottom";
  g.fillText(t("drift.time.moved-from", { distance: mm(movedMm) }), left + 5 * ratio, y(movedMm));
  for (const { at, events } of all)
    for (const { kind } of events) {
      const { mark, ink: of } = KINDS[kind];
      g.strokeStyle = g.fillStyle = ink(of);
      g.beginPath();
      g.moveTo(x(at), top + 16 * ratio);
      g.lineTo(x(at), top + height);
      g.stroke();
      g.textAlign = "center";
      g.textBaseline = "top";
      g.font = fontOf(13 * ratio);
      g.fillText(mark, Math.min(x(at), left + width - 7 * ratio), top + ratio);
    }
  g.strokeStyle = g.fillStyle = ink("--text");
  g.lineWidth = 1.8 * ratio;
  g.beginPath();
  let before = -Infinity;
  for (const { at, entry, mm: far } of all) {
    if (far === null) continue;
    if (entry - before > GAP * entryS) g.moveTo(x(at) - ratio, y(far));
    g.lineTo(x(at), y(far));
    before = entry;
  }
  g.stroke();
  g.restore();
}
