// The checklist of a saved version: a headline, three figures, and a line for each check.
import { mm, number, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { camera } from "../../../core/state.js";
import { Title } from "../../../ui/title.js";
import { robotTopsMm } from "../../calibrate/camera_height.js";
import { isSaved, version } from "../../versions/versions.js";
import { checks, gate, problems } from "../checks.js";
import { ActivationWarning } from "./activation_warning.js";
import { ChangeMap } from "./change_map.js";

/** Told apart by their shape, and their names for whoever hears the page. */
const ICONS = {
  running: { name: "Running", d: "M5 12h.01M12 12h.01M19 12h.01" },
  ok: { name: "OK", d: "M4 12.5l5.5 5.5L20 6.5" },
  note: { name: "Note", d: "M12 3.5L22 20.5H2zM12 10v5M12 17.6v.1" },
  bad: { name: "Problem", d: "M8 2.5h8L21.5 8v8L16 21.5H8L2.5 16V8zM8.7 8.7l6.6 6.6M15.3 8.7l-6.6 6.6" },
  unknown: { name: "Unknown", d: "M8 8.5a4 4 0 1 1 5.6 3.7c-1 .5-1.6 1.2-1.6 2.3v.5M12 19v.1" },
};

export function Checklist() {
  const it = version.value;
  if (!it) return null;
  const { report } = it,
    tops = robotTopsMm(report),
    points = it.observations.reduce((sum, o) => sum + o.points.length, 0);
  return html`
    <section class="checklist" aria-label="Checklist" data-testid="checklist" data-gate=${gate.value}>
      <div class=${`headline ${gate.value}`} role="status">
        <${Icon} state=${/** @type {const} */ ({ ok: "ok", warn: "bad", wait: "running" })[gate.value]} />
        <h2 data-testid="headline">${headline(it.active)}</h2>
        <small>Version ${it.version}, ${plural(points, "point")}</small>
      </div>
      ${!isSaved.value && html`<p class="warning-line" data-testid="points-changed">
        The points have changed since this version was saved.
      </p>`}
      <dl class="figures">
        <${Figure}
          value=${report.verdict.level === "unknown" ? null : mm(report.verdict.mm)}
          unit="mm"
          of="inside the field"
        />
        <${Figure} value=${tops === null ? null : mm(tops)} unit="mm" of="robot tops" />
        <${Figure} value=${number(report.rms_px, 2)} unit="px" of="residual" />
      </dl>
      <${Title} of="checks">Checks<//>
      <ul class="checks">
        ${checks.value.map((c) => html`<${Item} key=${c.id} it=${c} />`)}
      </ul>
    </section>
    <${ChangeMap} />
    <${ActivationWarning} />
  `;
}

/** @param {boolean} isActive */
function headline(isActive) {
  const count = plural(problems.value.length, "problem");
  if (gate.value === "wait") return "Checking…";
  if (isActive) return gate.value === "ok" ? "Active" : `Active, with ${count}`;
  if (!camera.value) return gate.value === "ok" ? "No problems" : `Not ready: ${count}`; // there is nothing to activate
  return gate.value === "ok" ? "Ready to activate" : `Not ready: ${count}`;
}

/** @param {{ value: string | null, unit: string, of: string }} props null: it is not known */
const Figure = ({ value, unit, of }) => html`<div>
  <dd>
    ${value ?? "?"}
    ${value !== null && html`<small>${" "}${unit}</small>`}
  </dd>
  <dt>${of}</dt>
</div>`;

/** @param {{ it: import("../types").Check }} props */
const Item = ({ it }) => html`<li
  class=${`${it.state} ${it.id}`}
  data-testid=${`check-${it.id}`}
  data-state=${it.state}
>
  <${Icon} state=${it.state} />
  <b>${it.title}</b>
  ${it.value && html`<em>${it.value}</em>`}
  <p>
    ${it.state === "running" ? "Checking…" : it.text}
    ${it.fix && html`
      ${" "}
      ${it.href ? html`<a href=${it.href}>${it.fix}</a>` : it.fix}
    `}
  </p>
</li>`;

/** @param {{ state: import("../types").CheckState }} props */
const Icon = ({ state }) => html`
  <svg class=${`state ${state}`} viewBox="0 0 24 24" aria-hidden="true"><path d=${ICONS[state].d} /></svg>
  <span class="sr">${ICONS[state].name}: </span>
`;
