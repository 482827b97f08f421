// What is clicked: the four borders and the lines inside, with their points and residuals.
import { colour } from "../../../canvas/drawing.js";
import { ACTIONS, run } from "../../../core/actions.js";
import { BORDERS, change, doc, pointsOf } from "../../../core/document.js";
import { lineName, lineTitle, mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { keyLabel } from "../../../core/keys.js";
import { active, field, model } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Fold } from "../../../ui/fold.js";
import { Title } from "../../../ui/title.js";
import { activateFeature } from "../editing.js";
import { isOffArea, lineUnder } from "../field_sides.js";
import { curves, isCurve, preview, stale } from "../fitting.js";
import { acceptProposed, canPropose, offered } from "../line_suggestions.js";

const SIDE = /-(left|right|top|bottom)$/; // the field's own: in a rotated image it would contradict the border's

export function BordersPanel() {
  const count = BORDERS.reduce((sum, border) => sum + pointsOf(doc.value, border).length, 0);
  return html`<section aria-label=${t("calibrate.borders.title")}>
    <${Title} of="borders" value=${t("common.points", { count })}>${t("calibrate.borders.title")}<//>
    <ul class="features" data-testid="borders">
      ${BORDERS.map((border) => html`<${BorderRow} key=${border} border=${border} />`)}
    </ul>
    <${Degree} />
  </section>`;
}

/** Lines, arcs and landmarks inside the field. */
export function InsidePanel() {
  const isInside = (/** @type {string | number} */ f) => !BORDERS.includes(/** @type {any} */ (f));
  const clicked = doc.value.observations.flatMap(({ feature }) =>
    typeof feature === "string" && isInside(feature) ? [feature] : [],
  );
  const inside = [...new Set([...clicked, ...(isInside(active.value) ? [active.value] : [])])],
    count = clicked.reduce((sum, feature) => sum + pointsOf(doc.value, feature).length, 0);
  return html`<section aria-label=${t("calibrate.borders.inside")}>
    <${Fold}
      id="inside"
      title=${t("calibrate.borders.inside-title")}
      value=${t("common.points", { count })}
      isWanted=${isInside(active.value)}
    >
      <${Title} of="inside">${t("calibrate.borders.inside")}<//>
      <ul class="features">
        ${inside.map((feature) => html`<${InsideRow} key=${feature} feature=${feature} />`)}
      </ul>
      <${AddInside} />
    <//>
  </section>`;
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
      class="feature measured"
      data-testid=${`border-${border}`}
      aria-pressed=${active.value === border}
      onClick=${() => run(`border-${border}`)}
      title=${
        refusal
          ? `${refusal.detail} ${refusal.fix}`
          : t("calibrate.borders.click", { border: lineName(border), key: keyLabel(key) })
      }
    >
      <i class="chip" style=${`--colour:${colour(border)}`}>
        ${lineTitle(border)[0]}
      </i>
      <span>${lineTitle(border)}</span>
      <em>${t("common.points", { count: points.length })}</em>
      <em class="value">${isCurve(curve) ? `${number(curve.rms_px, 2)} px` : refusal ? "⚠" : "–"}</em>
      ${painted && html`<small>${lineTitle(painted.replace(SIDE, ""))}</small>`}
    </button>
  </li>`;
}

/** @param {{ feature: string }} props */
function InsideRow({ feature }) {
  const row = stale.value
    ? undefined
    : preview.value?.report.per_feature.find((f) => f.feature === feature);
  return html`<li>
    <button
      type="button"
      class="feature measured"
      data-testid=${`inside-${feature}`}
      aria-pressed=${active.value === feature}
      onClick=${() => activateFeature(feature)}
    >
      <i class="chip" style=${`--colour:${colour(feature)}`}>
        +
      </i>
      <span>${lineTitle(feature)}</span>
      <em>${t("common.points", { count: pointsOf(doc.value, feature).length })}</em>
      <em class="value">${row ? `${mm(row.rms_mm)} mm` : "–"}</em>
      ${row && html`<small>${row.used ? t("calibrate.borders.used") : t("calibrate.borders.checks")}</small>`}
      ${isOffArea(feature) && html`<small class="level fair">${t("calibrate.borders.off-area")}</small>`}
    </button>
  </li>`;
}

/** Points all along the active line: looked for, shown, and added when the operator says so; or all taken off. */
export function Along() {
  const items = offered.value,
    name = lineName(active.value),
    count = items.reduce((sum, it) => sum + it.points.length, 0);
  if (items.length)
    return html`<div class="along" data-testid="proposal">
      ${
        items.length > 1 &&
        html`<ul class="plain" aria-label=${t("calibrate.borders.detected")}>
        ${items.map(
          (it) => html`<li key=${it.feature} class="line">
          <span class="grow">${lineTitle(it.feature)}</span>
          <button type="button" data-testid=${`accept-${it.feature}`} onClick=${() => acceptProposed([it])}>
            ${t("calibrate.borders.add", { count: it.points.length })}
          </button>
        </li>`,
        )}
      </ul>`
      }
      <div class="line">
        <${ActionButton}
          id="propose"
          label=${items.length > 1 ? t("calibrate.borders.add-all", { count }) : t("calibrate.borders.add", { count })}
          kind="go"
        />
        <${ActionButton} id="discard" />
      </div>
    </div>`;
  return html`<div class="line along">
    ${
      canPropose.value &&
      html`<${ActionButton} id="propose" label=${t("calibrate.borders.find-along", { feature: name })} />`
    }
    <${ActionButton} id="clear" label=${t("calibrate.borders.clear", { feature: name })} />
  </div>`;
}

/** Any line, arc or landmark that is painted. */
function AddInside() {
  const f = field.value;
  if (!f) return null;
  const borders = new Set(BORDERS.map(lineUnder));
  /** @type {[string, string[]][]} */
  const groups = [
    [t("calibrate.borders.group.lines"), f.lines.map((l) => l.name).filter((n) => !borders.has(n))],
    [t("calibrate.borders.group.arcs"), f.arcs.map((a) => a.name)],
    [t("calibrate.borders.group.landmarks"), Object.keys(f.landmarks)],
  ];
  return html`<select
    class="add"
    data-testid="add-inside"
    aria-label=${t("calibrate.borders.add-inside")}
    value=""
    onChange=${(/** @type {any} */ e) => {
      activateFeature(e.target.value);
      e.target.value = "";
    }}
  >
    <option value="" disabled>
      ${t("calibrate.borders.add-inside.choose")}
    </option>
    ${groups.map(
      ([title, names]) => html`<optgroup key=${title} label=${title}>
      ${names.map(
        (name) => html`<option key=${name} value=${name}>
        ${lineTitle(name)}
      </option>`,
      )}
    </optgroup>`,
    )}
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
    change({
      ...doc.value,
      options: text === "auto" ? others : { ...others, degree: Number(text) },
    });
  };
  const isChosen = model.value?.options.some((o) => o.name === "degree");
  return html`
    ${
      isChosen &&
      html`<label class="pair">
      <span>${t("calibrate.borders.degree")}</span>
      <select
        data-testid="degree"
        value=${String(value)}
        onChange=${(/** @type {any} */ e) => choose(e.target.value)}
      >
        <option value="auto">${t("calibrate.options.auto")}</option>
        ${[1, 2, 3, 4, 5, 6, 7, 8].map(
          (d) => html`<option key=${d} value=${String(d)}>
          ${d}
        </option>`,
        )}
      </select>
    </label>`
    }
    ${
      isChosen &&
      isCurve(curve) &&
      html`<p class="reason" data-testid="degree-reason">
      <b>
        ${t("calibrate.borders.degree-found", { border: lineTitle(border), degree: curve.degree })}
      </b>${" "}
      ${curve.degree_reason}
    </p>`
    }
  `;
}
