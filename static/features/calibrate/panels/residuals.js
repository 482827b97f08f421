// How far each click lies from its line: along every line, or how often how far; to point at one is to see it in the
// picture.
import { lineTitle, mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { comparing, editing, selectedPoints } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Fold } from "../../../ui/fold.js";
import { Plot, ink } from "../../../ui/canvas_plot.js";
import { rich } from "../../../ui/rich.js";
import { colour } from "../../../canvas/drawing.js";
import { reveal } from "../../../canvas/viewport.js";
import { select } from "../editing.js";
import { preview, stale } from "../fitting.js";
import { binned, groups, hovered, isSame, plot, pointAt, valueOf } from "../residuals.js";
import { arrows } from "../../compare/residual_arrows.js";

/**
 * @typedef {import("../residuals.js").Bar} Bar
 * @typedef {import("../../../core/types").Pick} Pick
 * @typedef {import("uplot")} UPlot
 */

const CURVE_STEPS = 80;
const MIN_SCALE = 0.05; // px or mm: a scale finer than that shows rounding
const HEIGHT = 150,
  GAP = 0.12; // of a line's share: between two lines
const NORMAL = 1 / Math.sqrt(2 * Math.PI);

/** @param {{ report?: import("../../../core/types").Report }} props a saved version's report, else the present one */
export function Residuals({ report }) {
  const { unit, kind } = plot.value,
    all = groups.value.flatMap((g) => g.bars),
    known = all.filter((bar) => valueOf(bar) !== null);
  if (!all.length) return null;
  const it = report ?? preview.value?.report,
    value = it
      ? t("calibrate.residuals.value", { rms: number(it.rms_px, 2), largest: number(it.max_px, 2) })
      : "";
  /** @param {Partial<typeof plot.value>} next @param {string} label @param {string} test @param {boolean} isOn */
  const choice = (next, label, test, isOn) => html`<button
    type="button"
    data-testid=${test}
    aria-pressed=${String(isOn)}
    onClick=${() => {
      plot.value = { ...plot.value, ...next };
    }}
  >
    ${label}
  </button>`;
  return html`<section
    class=${editing.value && stale.value && unit === "mm" ? "stale" : ""}
    aria-label=${t("calibrate.residuals.title")}
  >
    <${Fold} id="residuals" title=${t("calibrate.residuals.title")} value=${value}>
    <div class="line choices">
      <div class="switch" role="group" aria-label=${t("calibrate.residuals.plot")}>
        ${choice({ kind: "along" }, t("calibrate.residuals.plot.along"), "plot-along", kind === "along")}
        ${choice(
          { kind: "histogram" },
          t("calibrate.residuals.plot.histogram"),
          "plot-histogram",
          kind === "histogram",
        )}
      </div>
      <div class="switch" role="group" aria-label=${t("calibrate.residuals.unit")}>
        ${choice({ unit: "px" }, "px", "unit-px", unit === "px")}
        ${choice({ unit: "mm" }, "mm", "unit-mm", unit === "mm")}
      </div>
    </div>
    ${
      known.length === 0
        ? html`<p class="reason">${t("calibrate.residuals.not-known", { unit })}</p>`
        : kind === "along"
          ? html`<${Along} />`
          : html`<${Histogram} bars=${known.filter((bar) => !bar.stray)} />`
    }
    <p class="reason" data-testid="residual-said" aria-live="off">
      ${said(known)}
    </p>
    <div class="line">
      <${ActionButton}
        id="arrows"
        label=${arrows.value.on ? t("calibrate.residuals.hide-arrows") : t("calibrate.residuals.show-arrows")}
      />
    </div>
    <//>
  </section>`;
}

/** What is pointed at, else of all. @param {Bar[]} known */
function said(known) {
  const here = known.filter((bar) => hovered.value.some((p) => isSame(p, bar)));
  if (here.length > 1) return rich("calibrate.residuals.here", { count: here.length });
  const far = known.reduce(
      (a, b) => (Math.abs(valueOf(b) ?? 0) > Math.abs(valueOf(a) ?? 0) ? b : a),
      known[0],
    ),
    strays = known.filter((bar) => bar.stray).length;
  if (here[0]) return oneOf(here[0]);
  if (!far) return far;
  const all = { count: known.length, largest: oneOf(far) };
  return strays
    ? rich("calibrate.residuals.all-strays", {
        ...all,
        strays: t("common.strays", { count: strays }),
      })
    : rich("calibrate.residuals.all", all);
}

/** @param {Bar} bar */
const oneOf = (bar) => html`
  <b>
    ${t("common.point-of", { feature: lineTitle(bar.feature), number: bar.index + 1 })}
  </b>
  : ${signed(bar.px, 2)} px${bar.mm === null ? "" : `, ${mm(Math.abs(bar.mm))} mm`}
  ${bar.stray ? t("calibrate.residuals.point.stray") : ""}
`;
/** @param {number | null} value @param {number} digits */
const signed = (value, digits) => (value !== null && value > 0 ? "+" : "") + number(value, digits);

/** To the point, where it can be worked on. @param {Bar} bar */
function take(bar) {
  if (comparing.value) reveal(...bar.point);
  else select([{ feature: bar.feature, index: bar.index }]);
}

function Along() {
  const lines = groups.value,
    xs = lines.flatMap((g, i) => g.bars.map((bar) => i + GAP + (1 - 2 * GAP) * bar.at)),
    bars = lines.flatMap((g) => g.bars);
  // The scale is that of the others: one stray would press them flat. It ends in an arrow at the edge.
  const values = bars.map(valueOf),
    fine = bars.filter((bar) => !bar.stray),
    most = Math.max(
      MIN_SCALE,
      ...(fine.length ? fine : bars).map((bar) => Math.abs(valueOf(bar) ?? 0)),
    );
  const shown = bars.findIndex((bar) => hovered.value.some((p) => isSame(p, bar)));
  /** @param {UPlot} u */
  const draw = (u) => {
    const g = u.ctx,
      ratio = devicePixelRatio,
      zero = u.valToPos(0, "y", true),
      { left, width } = u.bbox;
    g.save();
    g.strokeStyle = ink("--dim");
    g.lineWidth = ratio;
    line(g, left, zero, left + width, zero);
    const [data, ys] = [u.data[0], u.data[1]];
    bars.forEach((bar, i) => {
      const v = ys[i];
      if (v === null || v === undefined) return;
      const x = u.valToPos(data[i], "x", true),
        beyond = Math.abs(v) > most,
        y = u.valToPos(beyond ? Math.sign(v) * most : v, "y", true),
        isPicked = selectedPoints.peek().some((p) => isSame(p, bar)),
        isHovered = hovered.peek().some((p) => isSame(p, bar));
      g.strokeStyle = g.fillStyle = colour(bar.feature);
      g.lineWidth = (isHovered || isPicked ? 2.4 : 1.4) * ratio;
      line(g, x, zero, x, y);
      g.beginPath();
      if (beyond) arrowHead(g, x, y, Math.sign(v) * 5 * ratio);
      else g.arc(x, y, (isHovered || isPicked ? 5 : 3.2) * ratio, 0, 7);
      if (bar.stray) g.stroke();
      else g.fill();
      if (isHovered || isPicked) {
        g.strokeStyle = ink("--text");
        g.lineWidth = 1.5 * ratio;
        g.stroke();
      }
    });
    g.restore();
  };
  return html`<${Plot}
    of=${`${lines.map((l) => l.feature).join()} ${plot.value.unit}`}
    name="residuals"
    height=${HEIGHT}
    label=${t("calibrate.residuals.along-label", { unit: plot.value.unit })}
    data=${[xs, values]}
    at=${shown}
    options=${() => ({
      axes: [
        {
          ...axis(),
          splits: () => lines.map((_, i) => i + 0.5),
          values: () =>
            lines.map((l) => (lines.length > 5 ? lineTitle(l.feature)[0] : lineTitle(l.feature))),
          grid: { show: false },
        },
        { ...axis(), size: 40 },
      ],
    })}
    draw=${draw}
    across=${[0, lines.length]}
    span=${[-1.15 * most, 1.15 * most]}
    describe=${(/** @type {number} */ i) =>
      bars[i]
        ? t("calibrate.residuals.point-residual", {
            feature: lineTitle(bars[i].feature),
            number: bars[i].index + 1,
            residual: signed(bars[i].px, 2),
          })
        : ""}
    point=${(/** @type {number} */ i) =>
      pointAt(bars[i] ? [{ feature: bars[i].feature, index: bars[i].index }] : [])}
    take=${(/** @type {number} */ i) => {
      if (bars[i]) take(bars[i]);
    }}
  />`;
}

/** @param {{ bars: Bar[] }} props */
function Histogram({ bars }) {
  const found = binned(bars);
  if (!found) return html`<p class="reason">${t("calibrate.residuals.too-few")}</p>`;
  const { width, from, bins } = found,
    xs = bins.map((_, i) => from + i * width),
    fine = bars.map((bar) => valueOf(bar) ?? 0);
  const sigma = Math.sqrt(fine.reduce((sum, v) => sum + v * v, 0) / Math.max(1, fine.length)),
    shown = bins.findIndex((bin) => bin.some((bar) => hovered.value.some((p) => isSame(p, bar))));
  /** @param {UPlot} u */
  const draw = (u) => {
    const g = u.ctx,
      ratio = devicePixelRatio,
      counts = u.data[1];
    g.save();
    u.data[0].forEach((x, i) => {
      const [l, r] = [x - width / 2, x + width / 2].map((v) => u.valToPos(v, "x", true)),
        top = u.valToPos(counts[i] ?? 0, "y", true),
        zero = u.valToPos(0, "y", true);
      g.fillStyle = ink(i === shown ? "--accent" : "--dim");
      g.fillRect(l + ratio, top, r - l - 2 * ratio, zero - top);
    });
    g.strokeStyle = ink("--text");
    g.lineWidth = 1.4 * ratio;
    g.beginPath();
    for (let i = 0; i <= CURVE_STEPS; i++) {
      const x = from - width / 2 + (bins.length * width * i) / CURVE_STEPS,
        y =
          (fine.length * width * NORMAL * Math.exp(-0.5 * (x / Math.max(sigma, 1e-9)) ** 2)) /
          Math.max(sigma, 1e-9);
      g.lineTo(u.valToPos(x, "x", true), u.valToPos(y, "y", true));
    }
    g.stroke();
    g.restore();
  };
  return html`
    <${Plot}
      of=${`${bins.length} ${width} ${plot.value.unit}`}
      name="histogram"
      height=${HEIGHT}
      label=${t("calibrate.residuals.histogram-label")}
      data=${[xs, bins.map((bin) => bin.length)]}
      at=${shown}
      options=${() => ({
        axes: [
          { ...axis(), grid: { show: false }, space: 44 },
          { ...axis(), size: 34, incrs: [1, 2, 5, 10, 20, 50, 100, 500, 1000] },
        ],
      })}
      draw=${draw}
      across=${[from - width / 2, from + (bins.length - 0.5) * width]}
      span=${[0, 1.15 * Math.max(2, ...bins.map((bin) => bin.length))]}
      describe=${(/** @type {number} */ i) =>
        bins[i]
          ? t("calibrate.residuals.bar", {
              count: bins[i].length,
              residual: signed(xs[i], 2),
              unit: plot.value.unit,
            })
          : ""}
      isEmpty=${(/** @type {number} */ i) => bins[i]?.length === 0}
      point=${(/** @type {number} */ i) =>
        pointAt((bins[i] ?? []).map(({ feature, index }) => ({ feature, index })))}
      take=${(/** @type {number} */ i) => {
        if (bins[i]?.length) {
          if (comparing.value) take(bins[i][0]);
          else select(bins[i].map(({ feature, index }) => ({ feature, index })));
        }
      }}
    />
    <p class="reason">
      ${t("calibrate.residuals.histogram-help", { sigma: number(sigma, 2), unit: plot.value.unit })}
    </p>
  `;
}

const axis = () => ({
  stroke: () => ink("--dim"),
  font: "11px system-ui, sans-serif",
  size: 22,
  gap: 4,
  space: 24,
  ticks: { show: false },
  grid: { stroke: () => ink("--line"), width: 1 },
  values: (/** @type {UPlot} */ _u, /** @type {number[]} */ splits) =>
    splits.map((v) =>
      number(
        v,
        Math.max(
          0,
          -Math.floor(Math.log10(Math.max(1e-3, Math.abs((splits[1] ?? 1) - splits[0])))),
        ),
      ),
    ),
});

/**
 * It goes on beyond.
 * @param {CanvasRenderingContext2D} g
 * @param {number} x
 * @param {number} y
 * @param {number} size negative: downwards on a screen
 */
function arrowHead(g, x, y, size) {
  g.moveTo(x, y - size);
  g.lineTo(x - Math.abs(size), y + 0.6 * size);
  g.lineTo(x + Math.abs(size), y + 0.6 * size);
  g.closePath();
}

/** @param {CanvasRenderingContext2D} g @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 */
function line(g, x0, y0, x1, y1) {
  g.beginPath();
  g.moveTo(x0, y0);
  g.lineTo(x1, y1);
  g.stroke();
}
