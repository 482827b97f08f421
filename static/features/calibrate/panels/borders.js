// What is clicked: the four borders and the lines inside, with their points and residuals.
import { ACTIONS, run } from "../../../core/actions.js";
import { BORDERS, change, doc, pointsOf } from "../../../core/document.js";
import { mm, number, plural, words } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { keyLabel } from "../../../core/keys.js";
import { active, field, model } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { colour } from "../../../canvas/drawing.js";
import { activateFeature } from "../editing.js";
import { lineUnder } from "../field_sides.js";
import { curves, isCurve, preview, stale } from "../fitting.js";
import { acceptProposed, canPropose, offered } from "../line_suggestions.js";
import { FindLines } from "./find_lines.js";

const SIDE = /-(left|right|top|bottom)$/; // the field's own: in a rotated image it would contradict the border's

export function BordersPanel() {
  const clicked = doc.value.observations
    .map((o) => o.feature)
    .filter((f) => typeof f === "string" && !BORDERS.includes(/** @type {any} */ (f)));
  const inside = [
    ...new Set([...clicked, ...(BORDERS.includes(/** @type {any} */ (active.value)) ? [] : [active.value])]),
  ];
  return html`
    <${FindLines} />
    <${Along} />
    <section aria-label="Borders">
      <${Title} of="borders">Borders<//>
      <ul class="features" data-testid="borders">
        ${BORDERS.map((border) => html`<${BorderRow} key=${border} border=${border} />`)}
      </ul>
      <${Degree} />
    </section>
    <section aria-label="Lines inside">
      <${Title} of="inside">Lines inside, to check the fit<//>
      <ul class="features">
        ${inside.map((feature) => html`<${InsideRow} key=${feature} feature=${feature} />`)}
      </ul>
      <${AddInside} />
    </section>
    <div class="line">
      <${ActionButton} id="clear" label=${`Clear ${words(active.value).toLowerCase()}`} />
    </div>
  `;
}

/** @param {{ border: import("../../../core/types").Border }} props */
function BorderRow({ border }) {
  const curve = curves.value[border],
    painted = lineUnder(border),
    key = ACTIONS.get(`border-${border}`)?.keys?.[0] ?? "";
  const points = pointsOf(doc.value, border),
    refusal = curve && !isCurve(curve) && points.length > 1 ? curve : null;
  return html`<li>
    <button
      type="button"
      class="feature"
      data-testid=${`border-${border}`}
      aria-pressed=${active.value === border}
      onClick=${() => run(`border-${border}`)}
      title=${refusal ? `${refusal.detail} ${refusal.fix}` : `Click the ${border} border (${keyLabel(key)})`}
    >
      <i class="chip" style=${`--colour:${colour(border)}`}>
        ${border[0].toUpperCase()}
      </i>
      <span>${words(border)}</span>
      <em>${plural(points.length, "point")}</em>
      <em class="value">${isCurve(curve) ? `${number(curve.rms_px, 2)} px` : refusal ? "⚠" : "–"}</em>
      ${painted && html`<small>${words(painted.replace(SIDE, ""))}</small>`}
    </button>
  </li>`;
}

/** @param {{ feature: string }} props */
function InsideRow({ feature }) {
  const row = stale.value ? undefined : preview.value?.report.per_feature.find((f) => f.feature === feature);
  return html`<li>
    <button
      type="button"
      class="feature"
      data-testid=${`inside-${feature}`}
      aria-pressed=${active.value === feature}
      onClick=${() => activateFeature(feature)}
    >
      <i class="chip" style=${`--colour:${colour(feature)}`}>
        +
      </i>
      <span>${words(feature)}</span>
      <em>${plural(pointsOf(doc.value, feature).length, "point")}</em>
      <em class="value">${row ? `${mm(row.rms_mm)} mm` : "–"}</em>
      ${row && html`<small>${row.used ? "Used by the fit" : "Checks the fit"}</small>`}
    </button>
  </li>`;
}

/** Points all along the active line: looked for, shown, and added when the operator says so. */
function Along() {
  const items = offered.value,
    name = words(active.value).toLowerCase(),
    count = items.reduce((sum, it) => sum + it.points.length, 0);
  if (items.length)
    return html`<div class="along" data-testid="proposal">
      ${items.length > 1 && html`<ul class="plain" aria-label="Detected lines">
        ${items.map((it) => html`<li key=${it.feature} class="line">
          <span class="grow">${words(it.feature)}</span>
          <button type="button" data-testid=${`accept-${it.feature}`} onClick=${() => acceptProposed([it])}>
            Add ${plural(it.points.length, "point")}
          </button>
        </li>`)}
      </ul>`}
      <div class="line">
        <${ActionButton}
          id="propose"
          label=${`Add ${items.length > 1 ? "all " : ""}${plural(count, "point")}`}
          kind="go"
        />
        <${ActionButton} id="discard" />
      </div>
    </div>`;
  return (
    canPropose.value && html`<div class="line along">
      <${ActionButton} id="propose" label=${`Find points along ${name}`} />
    </div>`
  );
}

/** Any line, arc or landmark that is painted. */
function AddInside() {
  const f = field.value;
  if (!f) return null;
  const borders = new Set(BORDERS.map(lineUnder));
  /** @type {[string, string[]][]} */
  const groups = [
    ["Lines", f.lines.map((l) => l.name).filter((n) => !borders.has(n))],
    ["Arcs", f.arcs.map((a) => a.name)],
    ["Landmarks", Object.keys(f.landmarks)],
  ];
  return html`<select
    class="add"
    data-testid="add-inside"
    aria-label="Add a line or landmark inside the field"
    value=""
    onChange=${(/** @type {any} */ e) => {
      activateFeature(e.target.value);
      e.target.value = "";
    }}
  >
    <option value="" disabled>
      Add a line or landmark…
    </option>
    ${groups.map(([title, names]) => html`<optgroup key=${title} label=${title}>
      ${names.map((name) => html`<option key=${name} value=${name}>
        ${words(name)}
      </option>`)}
    </optgroup>`)}
  </select>`;
}

/** How bent the curves may be, and why the server chose what it did. */
function Degree() {
  const value = doc.value.options.degree ?? "auto",
    border = /** @type {import("../../../core/types").Border} */ (active.value),
    curve = curves.value[border];
  /** @param {string} text */
  const choose = (text) => {
    const { degree: _, ...others } = doc.value.options;
    change({ ...doc.value, options: text === "auto" ? others : { ...others, degree: Number(text) } });
  };
  const isChosen = model.value?.options.some((o) => o.name === "degree");
  return html`
    ${isChosen && html`<label class="pair">
      <span>Degree of the curves</span>
      <select
        data-testid="degree"
        value=${String(value)}
        onChange=${(/** @type {any} */ e) => choose(e.target.value)}
      >
        <option value="auto">Auto</option>
        ${[1, 2, 3, 4, 5, 6, 7, 8].map((d) => html`<option key=${d} value=${String(d)}>
          ${d}
        </option>`)}
      </select>
    </label>`}
    ${isCurve(curve) && html`<p class="reason" data-testid="degree-reason">
      <b>
        ${words(border)}: degree ${curve.degree}.
      </b>${" "}
      ${curve.degree_reason}
    </p>`}
  `;
}
