// One option of a model as a form field, built from what the server says about it: name, type, range, unit, help.
import { change, doc } from "../../../core/document.js";
import { optionName } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { model, modelTitle } from "../../../core/state.js";
import { nameOr, t } from "../../../core/words.js";
import { LengthInput } from "../../../ui/length_input.js";
import { Typed } from "../../../ui/typed.js";
import { KnownLens } from "./known_lens.js";

/** @typedef {import("../../../core/types").Option} Option */
/**
 * @typedef {{ option: Option, value: any, set: (value: unknown) => void, about: Record<string, string> }} Props
 * set(null): as if nothing had been said
 */
/** @typedef {{ target: HTMLInputElement & HTMLSelectElement }} Changed */

const FEW = 20; // so many whole numbers are a list, more are a number field
const TAPE_MM = 30; // how sure a tape measure makes, until the operator says otherwise

/** @param {{ option: Option }} props */
export function OptionField({ option }) {
  const { name, default: fallback } = option;
  // stands beside that lens
  if (model.value?.options.some((o) => o.type === "calibration" && name === `${o.name}_sigma`))
    return null;
  const value = doc.value.options[name] ?? fallback;
  /** @param {unknown} v */
  const set = (v) => {
    const { [name]: _, ...others } = doc.value.options;
    change({
      ...doc.value,
      options: v === null || v === fallback ? others : { ...others, [name]: v },
    });
  };
  return html`<${OptionRow} option=${option} id=${`option-${name}`} value=${value} set=${set} />`;
}

/**
 * An option of anything, with what it stands at.
 * @param {{ option: Option, id: string, value: any, set: (value: unknown) => void }} props set(null): as if nothing had
 * been said
 */
export function OptionRow({ option, id, value, set }) {
  const { name, unit, help, type } = option;
  const Control = CONTROLS[type] ?? NumberField,
    about = { id, "data-testid": id, "aria-describedby": `${id}-help` };
  return html`<div class=${`option ${type}`}>
    <label class="pair" for=${id}>
      <span>${optionName(name)}</span>
      <span class="with-unit">
        <${Control} option=${option} value=${value} set=${set} about=${about} />
        ${unit && html`<small>${unit}</small>`}
      </span>
    </label>
    <p class="reason" id=${`${id}-help`}>
      ${help}
      ${range(option)}
    </p>
  </div>`;
}

/** What a choice is called: a model, a colour, or one of its own; numbers as they are. @param {string} choice */
const choiceName = (choice) =>
  nameOr(`calibrate.choice.${choice}`, nameOr(`detection.colour.${choice}`, modelTitle(choice)));

/** @param {Option} option */
const range = ({ range: r, type }) => {
  if (!r) return "";
  const [least, most] = r;
  return type.endsWith("-or-auto")
    ? ` ${t("calibrate.options.auto-or-range", { least, most })}`
    : ` ${t("calibrate.options.range", { least, most })}`;
};

/** @param {Props} props */
const Tick = ({ value, set, about }) => html`<input
  type="checkbox"
  ...${about}
  checked=${Boolean(value)}
  onChange=${(/** @type {Changed} */ e) => set(e.target.checked)}
/>`;

/** A list to choose from; what is not chosen is null. @param {Props & { choices: [string, unknown][] }} props */
const List = ({ value, set, about, choices }) => html`<select
  ...${about}
  value=${String(choices.findIndex(([, v]) => v === value))}
  onChange=${(/** @type {Changed} */ e) => set(choices[Number(e.target.value)][1])}
>
  ${choices.map(
    ([text], i) => html`<option key=${text} value=${String(i)}>
    ${text}
  </option>`,
  )}
</select>`;

/** @param {Props} props */
function Choice(props) {
  const { choices, default: fallback } = props.option;
  /** @type {[string, unknown][]} */
  const named = choices.map((c) => [choiceName(c), c]);
  return html`<${List}
    ...${props}
    choices=${fallback === null ? [[t("calibrate.options.not-set"), null], ...named] : named}
  />`;
}

/** @param {Props} props */
function IntOrAuto(props) {
  const r = props.option.range;
  if (!r || r[1] - r[0] > FEW) return html`<${NumberField} ...${props} />`;
  return html`<${List}
    ...${props}
    choices=${[
      [t("calibrate.options.auto"), "auto"],
      ...Array.from({ length: r[1] - r[0] + 1 }, (_, i) => [String(r[0] + i), r[0] + i]),
    ]}
  />`;
}

/** @param {Props} props */
function NumberField({ option: { type, range: r }, value, set, about }) {
  return html`<${Typed}
    type="number"
    ...${about}
    step=${type.startsWith("int") ? 1 : "any"}
    min=${r?.[0]}
    max=${r?.[1]}
    placeholder=${t("calibrate.options.auto")}
    value=${value === "auto" || value === null ? "" : value}
    take=${(/** @type {string} */ text) => set(text === "" ? null : Number(text))}
  />`;
}

/** A measure and how sure it is: 2 500 ± 30. @param {Props} props */
function ValueAndSigma({ option: { range: r, default: fallback }, value, set, about }) {
  const now = /** @type {{ value: number, sigma: number } | null} */ (value ?? fallback);
  const setValue = (/** @type {number | null} */ mm) =>
    set(mm === null ? null : { value: mm, sigma: now?.sigma ?? TAPE_MM });
  return html`
    <${LengthInput}
      ...${about}
      range=${r}
      placeholder=${t("calibrate.options.not-set")}
      value=${now?.value ?? null}
      take=${setValue}
    />
    ${
      now &&
      html`
      <span>±</span>
      <${Typed}
        type="number"
        aria-label=${t("calibrate.options.sigma")}
        step="any"
        min="0.1"
        max="5000"
        value=${now.sigma}
        take=${(/** @type {string} */ text) => set({ ...now, sigma: Number(text) })}
      />
    `
    }
  `;
}

/** Terms of a lens: Auto, or those that are ticked. @param {Props} props */
function Terms({ option: { choices }, value, set, about }) {
  const isAuto = value === "auto",
    chosen = isAuto ? [] : /** @type {string[]} */ (value);
  /** @param {string} term */
  const toggle = (term) => set(choices.filter((c) => (c === term) !== chosen.includes(c)));
  return html`<span class="terms" role="group">
    <label>
      <input type="checkbox" ...${about} checked=${isAuto} onChange=${() => set(isAuto ? [choices[0]] : null)} />${" "}
      ${t("calibrate.options.auto")}
    </label>
    ${
      !isAuto &&
      choices.map(
        (term) => html`<label key=${term}>
        <input type="checkbox" checked=${chosen.includes(term)} onChange=${() => toggle(term)} /> ${term}
      </label>`,
      )
    }
  </span>`;
}

/** Some of a few names, in their order. @param {Props} props */
function Names({ option: { name, choices }, value, set, about }) {
  const chosen = /** @type {string[]} */ (value);
  /** @param {string} one */
  const toggle = (one) =>
    set(chosen.includes(one) ? chosen.filter((c) => c !== one) : [...chosen, one]);
  return html`<span class="terms" role="group" aria-label=${optionName(name)}>
    ${choices.map(
      (one, i) => html`<label key=${one}>
      <input
        type="checkbox"
        ...${i ? {} : about}
        checked=${chosen.includes(one)}
        onChange=${() => toggle(one)}
      />${" "}
      ${choiceName(one)}
    </label>`,
    )}
  </span>`;
}

/** @type {Record<string, (props: Props) => any>} */
const CONTROLS = {
  bool: Tick,
  choice: Choice,
  "int-or-auto": IntOrAuto,
  int: NumberField,
  float: NumberField,
  "value-and-sigma": ValueAndSigma,
  "terms-or-auto": Terms,
  names: Names,
  calibration: KnownLens,
};
