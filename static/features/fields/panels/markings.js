// Right of the drawing: every line, arc and landmark, on or off, and the numbers of the chosen one.
import { lineName, lineTitle } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Fold } from "../../../ui/fold.js";
import {
  entryOf,
  isOff,
  markTitle,
  paintedMarks,
  renamed,
  switched,
  withChanges,
} from "../document.js";
import { chosen, edit, history, isShipped } from "../editor.js";
import { includes, withGripAt, withMoved, withRadius } from "../geometry.js";
import { Measured } from "./measured.js";
import { NumberInput, TextInput } from "./numbers.js";

/**
 * @typedef {import("../types").FieldDoc} FieldDoc
 * @typedef {import("../types").Mark} Mark
 * @typedef {import("../../../core/types").Point} Point
 */

export function Markings() {
  const doc = history.doc.value;
  if (!doc) return null;
  return html`
    <${Chosen} doc=${doc} />
    <section aria-label=${t("field-editor.marking.painted")}>
      <h2>${t("field-editor.marking.painted")}</h2>
      <ul class="features markings">
        ${paintedMarks(doc).map((mark) => html`<${Row} key=${mark.name} doc=${doc} mark=${mark} />`)}
      </ul>
      <div class="line">
        <${ActionButton} id="add-line" />
        <${ActionButton} id="add-arc" />
      </div>
    </section>
    <${Fold}
      id="landmarks"
      title=${t("field-editor.marking.landmarks", { count: Object.keys(doc.landmarks).length })}
    >
      <ul class="features markings">
        ${Object.keys(doc.landmarks).map(
          (name) => html`<${Row}
          key=${name}
          doc=${doc}
          mark=${{ kind: "landmark", name }}
        />`,
        )}
      </ul>
      <${ActionButton} id="add-landmark" />
    <//>
    <${Measured} doc=${doc} />
  `;
}

/** @param {{ doc: FieldDoc, mark: Mark }} props */
function Row({ doc, mark }) {
  const { kind, name } = mark,
    off = isOff(doc, mark);
  return html`<li class="marking">
    ${
      kind === "landmark"
        ? html`<i></i>`
        : html`<input
        type="checkbox"
        data-testid=${`on-${name}`}
        aria-label=${t("field-editor.marking.on", { marking: lineName(name) })}
        checked=${!off}
        disabled=${isShipped.value}
        onChange=${(/** @type {any} */ e) => edit((d) => switched(d, mark, e.target.checked))}
      />`
    }
    <button
      type="button"
      class="feature model"
      data-testid=${`mark-${name}`}
      aria-pressed=${includes(chosen.value, mark)}
      disabled=${off}
      onClick=${(/** @type {MouseEvent} */ e) => {
        chosen.value = e.shiftKey
          ? [...chosen.value.filter((m) => !includes([mark], m)), mark]
          : [mark];
      }}
    >
      <span>${lineTitle(name)}</span>
    </button>
  </li>`;
}

/** The numbers of what is chosen; of several, the way to move them together. @param {{ doc: FieldDoc }} props */
function Chosen({ doc }) {
  const marks = chosen.value,
    [mark] = marks;
  if (!mark)
    return html`<section>
      <h2>${t("field-editor.chosen.nothing")}</h2>
      <p class="reason">${t("field-editor.chosen.how")}</p>
    </section>`;
  const title =
    marks.length > 1 ? t("field-editor.chosen.count", { count: marks.length }) : markTitle(mark);
  return html`<section aria-label=${t("field-editor.chosen.panel")} data-testid="chosen">
    <h2>${title}</h2>
    ${
      marks.length === 1 &&
      html`
      <${TextInput}
        label=${t("field-editor.chosen.name")}
        entry=${`${entryOf(doc, mark)}.name`}
        value=${mark.name}
        set=${(/** @type {FieldDoc} */ d, /** @type {string} */ name) => {
          if (!name || name === mark.name || nameIsTaken(d, name)) return d;
          chosen.value = [{ kind: mark.kind, name }];
          return renamed(d, mark, name);
        }}
      />
      <${Numbers} doc=${doc} mark=${mark} />
    `
    }
    ${!marks.some(({ kind }) => kind === "region") && html`<${Shift} marks=${marks} />`}
    <${ActionButton}
      id="field-remove"
      label=${
        mark.kind === "landmark" || mark.kind === "region"
          ? t("field-editor.chosen.remove")
          : t("field-editor.action.field-remove.short")
      }
    />
  </section>`;
}

/** @param {FieldDoc} doc @param {string} name */
const nameIsTaken = (doc, name) =>
  [...doc.lines, ...doc.arcs].some((it) => it.name === name) ||
  name in doc.landmarks ||
  name in doc.regions;

/** @param {{ doc: FieldDoc, mark: Mark }} props */
function Numbers({ doc, mark }) {
  const { kind, name } = mark,
    entry = entryOf(doc, mark);
  /**
   * @param {"from" | "to" | "centre" | "at"} end
   * @param {string} key
   * @param {Point} at
   * @param {(doc: FieldDoc, to: Point) => FieldDoc} to
   */
  const place = (end, key, at, to) =>
    [0, 1].map(
      (axis) => html`<${NumberInput}
        key=${end + axis}
        label=${t(`field-editor.chosen.${end}-axis`, { axis: "xy"[axis] })}
        entry=${`${key}[${axis}]`}
        value=${at[axis]}
        set=${(/** @type {FieldDoc} */ d, /** @type {number} */ v) => to(d, axis ? [at[0], v] : [v, at[1]])}
      />`,
    );
  /** @param {string} label @param {string} key @param {number} value @param {string} [unit] */
  const number = (label, key, value, unit = "mm") => html`<${NumberInput}
    label=${label}
    entry=${`${entry}.${key}`}
    value=${value}
    unit=${unit}
    set=${(/** @type {FieldDoc} */ d, /** @type {number} */ v) =>
      key === "radius_mm" ? withRadius(d, name, v) : withChanges(d, mark, { [key]: v })}
  />`;
  const line = kind === "line" && doc.lines.find((l) => l.name === name),
    arc = kind === "arc" && doc.arcs.find((a) => a.name === name),
    region = kind === "region" && doc.regions[name];
  if (line)
    return html`
      ${place("from", `${entry}.from`, line.from, (d, to) => withGripAt(d, { mark, part: "from", at: line.from }, to))}
      ${place("to", `${entry}.to`, line.to, (d, to) => withGripAt(d, { mark, part: "to", at: line.to }, to))}
      ${number(t("field-editor.chosen.line-width"), "width_mm", line.width_mm)}
    `;
  if (arc)
    return html`
      ${place("centre", `${entry}.centre`, arc.centre, (d, to) => withMoved(d, [mark], by(arc.centre, to)))}
      ${number(t("field-editor.chosen.radius"), "radius_mm", arc.radius_mm)}${" "}
      ${number(t("field-editor.chosen.line-width"), "width_mm", arc.width_mm)}
      ${number(t("field-editor.chosen.angle-from"), "start_deg", arc.start_deg, "°")}${" "}
      ${number(t("field-editor.chosen.angle-to"), "end_deg", arc.end_deg, "°")}
    `;
  if (region) return html`<${RegionNumbers} mark=${mark} entry=${entry} region=${region} />`;
  const at = doc.landmarks[name];
  return at ? place("at", entry, at, (d, to) => withMoved(d, [mark], by(at, to), true)) : null;
}

/** @param {Point} from @param {Point} to @returns {Point} */
const by = (from, to) => [to[0] - from[0], to[1] - from[1]];

/** @param {{ mark: Mark, entry: string, region: import("../types").EditedRegion }} props */
const RegionNumbers = ({ mark, entry, region }) => html`
  ${["x", "y"].flatMap((axis) =>
    [0, 1].map((end) => {
      const span = region[/** @type {"x" | "y"} */ (axis)];
      return html`<${NumberInput}
        key=${axis + end}
        label=${end ? t("field-editor.chosen.axis-to", { axis }) : t("field-editor.chosen.axis-from", { axis })}
        entry=${`${entry}.${axis}[${end}]`}
        value=${span[end]}
        set=${(/** @type {FieldDoc} */ d, /** @type {number} */ v) =>
          withChanges(d, mark, { [axis]: end ? [span[0], v] : [v, span[1]] })}
      />`;
    }),
  )}
  <label class="pair length">
    <span>${t("field-editor.chosen.turned")}</span>
    <select
      data-testid=${`entry-${entry}.rotate`}
      value=${region.rotate}
      disabled=${isShipped.value}
      onChange=${(/** @type {any} */ e) => edit((d) => withChanges(d, mark, { rotate: Number(e.target.value) }))}
    >
      ${[0, 90, 180, 270].map(
        (deg) => html`<option key=${deg} value=${deg}>
        ${deg}°
      </option>`,
      )}
    </select>
  </label>
`;

/** Move by typed millimetres. @param {{ marks: Mark[] }} props */
const Shift = ({
  marks,
}) => html`<div class="line shift" role="group" aria-label=${t("field-editor.chosen.move")}>
  ${["x", "y"].map(
    (axis) => html`<label key=${axis}>
    ${t("field-editor.chosen.move-axis", { axis })}${" "}
    <input
      type="number"
      step="any"
      class="short"
      data-testid=${`move-${axis}`}
      disabled=${isShipped.value}
      onChange=${(/** @type {{ target: HTMLInputElement }} */ { target }) => {
        const v = Number(target.value);
        target.value = "";
        if (v) edit((d) => withMoved(d, marks, axis === "x" ? [v, 0] : [0, v]));
      }}
    />
  </label>`,
  )}
</div>`;
