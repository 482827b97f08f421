// A saved version on one panel: a headline, three figures, what stands against it with its cures, and what passed in
// one line that opens.
import { mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { camera } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { robotTopsMm } from "../../calibrate/camera_height.js";
import { Fixes, Warnings } from "../../calibrate/panels/warnings.js";
import { Guide } from "../../shell/panels/guide.js";
import { current } from "../../shell/steps.js";
import { isSaved, version } from "../../versions/versions.js";
import { checks, gate, problemCount, untestedCount } from "../checks.js";
import { ChangeMap } from "./change_map.js";
import { ModelOffer } from "./model_offer.js";

/** Told apart by their shape, and their names for whoever hears the page. */
const ICONS = {
  running: { name: t("verify.state.running"), d: "M5 12h.01M12 12h.01M19 12h.01" },
  ok: { name: t("verify.state.ok"), d: "M4 12.5l5.5 5.5L20 6.5" },
  note: { name: t("verify.state.note"), d: "M12 3.5L22 20.5H2zM12 10v5M12 17.6v.1" },
  bad: {
    name: t("verify.state.bad"),
    d: "M8 2.5h8L21.5 8v8L16 21.5H8L2.5 16V8zM8.7 8.7l6.6 6.6M15.3 8.7l-6.6 6.6",
  },
  unknown: {
    name: t("verify.state.unknown"),
    d: "M8 8.5a4 4 0 1 1 5.6 3.7c-1 .5-1.6 1.2-1.6 2.3v.5M12 19v.1",
  },
};

/** @type {Record<typeof gate.value, import("../types").CheckState>} */
const GATE_ICONS = { ready: "ok", "not-tested": "unknown", problems: "bad", wait: "running" };

/** Warnings of a fit that say what a check says as well: they are one entry. @type {Record<string, string>} */
const SAME_CAUSE = Object.fromEntries(
  ["height-unknown", "implausible-camera", "height-contradicted", "unusual-height"].map((w) => [
    w,
    "height",
  ]),
);

export function Checklist() {
  const it = version.value;
  if (!it)
    return html`
      <${Guide} />
      <div class="line"><${ActionButton} id="step-points" label=${t("verify.go-to-points")} /></div>
    `;
  const { report } = it,
    tops = robotTopsMm(report);
  const passed = checks.value.filter((c) => c.state === "ok"),
    open = checks.value
      .filter((c) => c.state !== "ok")
      .toSorted((a, b) => Number(b.isProblem) - Number(a.isProblem)),
    shown = isSaved.value ? gate.value : "not-tested"; // the checks are not of what is shown on the left
  const causeOf = (/** @type {import("../types").Check} */ c) =>
      report.warnings.find((w) => SAME_CAUSE[w.reason] === c.id),
    others = report.warnings.filter((w) => !open.some((c) => SAME_CAUSE[w.reason] === c.id));
  return html`
    <section class="checklist" aria-label=${t("verify.checklist")} data-testid="checklist" data-gate=${gate.value}>
      <h1 class="sr">${current.value.label} – Touchline</h1>
      <div class=${`headline ${shown}`} role="status">
        <${Icon} state=${GATE_ICONS[shown]} />
        <h2 data-testid="headline">${headline(it)}</h2>
        <small data-testid="sentence">${current.value.sentence}</small>
      </div>
      <dl class="figures" data-testid="verdict" data-level=${report.verdict.level}>
        <${Figure}
          value=${report.verdict.level === "unknown" ? null : mm(report.verdict.mm)}
          unit="mm"
          of=${t("verify.figure.inside")}
          level=${report.verdict.levels?.carpet}
        />
        <${Figure}
          value=${tops === null ? null : mm(tops)}
          unit="mm"
          of=${t("verify.figure.robot-tops")}
          level=${report.verdict.levels?.robot_tops}
          test="robot-tops"
        />
        <${Figure} value=${number(report.rms_px, 2)} unit="px" of=${t("verify.figure.residual")} test="rms-px" />
      </dl>
      <${Title} of="checks">${t("verify.checks")}<//>
      <ul class="checks">
        ${open.map((c) => html`<${Item} key=${c.id} it=${c} cause=${causeOf(c)} />`)}
      </ul>
      <${ModelOffer} />
      <${Warnings} warnings=${others} canFix=${isSaved.value} />
      ${
        passed.length > 0 &&
        html`<details class="fold" data-testid="fold-passed">
        <summary>
          <${Icon} state="ok" />
          <h2>${t("verify.passed", { count: passed.length })}</h2>
        </summary>
        <ul class="checks">
          ${passed.map((c) => html`<${Item} key=${c.id} it=${c} />`)}
        </ul>
      </details>`
      }
    </section>
    <${ChangeMap} />
  `;
}

/** @param {import("../../../core/types").Calibration} it */
function headline(it) {
  const isActive = it.active;
  const count = problemCount.value;
  if (!isSaved.value) return t("verify.headline.draft-differs", { version: it.version });
  switch (gate.value) {
    case "wait":
      return t("verify.checking");
    case "problems":
      return isActive
        ? t("verify.headline.active-problems", { count })
        : t("verify.headline.not-ready", { count });
    case "not-tested":
      return t(isActive ? "verify.headline.active-not-tested" : "verify.headline.not-tested", {
        count: untestedCount.value,
      });
    default: // without a camera there is nothing to activate
      return isActive
        ? t("common.active")
        : t(camera.value ? "verify.headline.ready" : "verify.headline.no-problems");
  }
}

/** @param {{ value: string | null, unit: string, of: string, level?: string | null, test?: string }} props null: it is
 * not known */
const Figure = ({ value, unit, of, level = "", test }) => html`<div>
  <dd class=${`level ${level ?? ""}`} data-testid=${test}>
    ${value ?? "?"}
    ${value !== null && html`<small>${" "}${unit}</small>`}
  </dd>
  <dt>${of}</dt>
</div>`;

/** cause: the fit's warning of the same, with what mends it.
 * @param {{ it: import("../types").Check, cause?: import("../../../core/types").Warning }} props */
const Item = ({ it, cause }) => html`<li
  class=${`${it.state} ${it.id}`}
  data-testid=${`check-${it.id}`}
  data-state=${it.state}
>
  <${Icon} state=${it.isProblem ? "bad" : it.state} />
  <b>${it.title}</b>
  ${it.value && html`<em>${it.value}</em>`}
  <p>
    ${it.state === "running" ? t("verify.checking") : it.text}
    ${!cause && it.fix && (it.href ? html` <a href=${it.href}>${it.fix}</a>` : ` ${it.fix}`)}
    ${cause && ` ${cause.fix}`}
  </p>
  ${cause && isSaved.value && html`<${Fixes} trouble=${cause} />`}
</li>`;

/** @param {{ state: import("../types").CheckState }} props */
const Icon = ({ state }) => html`
  <svg class=${`state ${state}`} viewBox="0 0 24 24" aria-hidden="true"><path d=${ICONS[state].d} /></svg>
  <span class="sr">${ICONS[state].name}: </span>
`;
