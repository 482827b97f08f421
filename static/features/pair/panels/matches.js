// Left of two pictures: where they come from, their calibrations, how high things are, and every match with its
// figures.
import { dayAndTime, mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { modelTitle } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { Title } from "../../../ui/title.js";
import { Typed } from "../../../ui/typed.js";
import { matchErrors, stale } from "../evaluation.js";
import { choose, removeMatch, setHeight } from "../matches.js";
import {
  SIDES,
  calibrations,
  chosen,
  hatMm,
  nextHeight,
  pair,
  pictures,
  setPicture,
  sourceOf,
  suitedCalibrations,
} from "../pair.js";

/** @typedef {import("../types").Side} Side @typedef {{ target: HTMLInputElement & HTMLSelectElement }} Changed */

export function PairForm() {
  const { matches } = pair.doc.value;
  return html`
    <section aria-label=${t("pair.pictures")}>
      <${Title} of="pair">${t("pair.pictures")}<//>
      ${SIDES.map((s) => html`<${Picture} key=${s} s=${s} />`)}
    </section>
    <section aria-label=${t("pair.matches")}>
      <h2>${t("pair.matches.count", { count: matches.length })}</h2>
      <label class="pair length">
        <span>${t("pair.height.next")}</span>
        <${Height}
          name="next-height"
          value=${nextHeight.value}
          label=${t("pair.height.next.label")}
          set=${(/** @type {number | null} */ z) => {
            nextHeight.value = z;
          }}
        />
      </label>
      <p class="reason" data-testid="pair-heights">
        ${hatMm.value === null ? t("pair.height.hat-unknown") : t("pair.height.hat", { hat: hatMm.value })}${" "}
        ${t("pair.height.empty")}
      </p>
      <ol class=${`matches${stale.value ? " stale" : ""}`} data-testid="matches">
        ${matches.map((_, index) => html`<${Row} key=${index} index=${index} />`)}
      </ol>
    </section>
  `;
}

/** @param {{ s: Side }} props */
function Picture({ s }) {
  const it = pictures.value[s],
    all = suitedCalibrations.value[s],
    own = pair.doc.value.calibrations[s],
    now = calibrations.value[s];
  if (!it)
    return html`<p class="reason">
      ${rich(`pair.picture.not-chosen.${s}`)}
    </p>`;
  /** @param {string} id */
  const use = (id) =>
    pair.change({ ...pair.doc.value, calibrations: { ...pair.doc.value.calibrations, [s]: id } });
  const title = (/** @type {import("../../../core/types").Calibration} */ c) =>
    t(c.active ? "pair.calibration.version-active" : "pair.calibration.version", {
      version: c.version,
      model: modelTitle(c.model.name),
      made: dayAndTime(c.created_at),
    });
  return html`<div class="pair-picture">
    <div class="line">
      <b>${t(`pair.picture.${s}`)}</b>
      <small>
        ${sourceOf(s)}, ${it.width} × ${it.height} px
      </small>
      <button type="button" data-testid=${`another-${s}`} onClick=${() => setPicture(s, null)}>
        ${t("pair.picture.another")}
      </button>
    </div>
    <label class="pair tall">
      <span class="sr">${t(`pair.calibration.of.${s}`)}</span>
      <select
        data-testid=${`calibration-${s}`}
        value=${now?.id ?? ""}
        disabled=${!all.length}
        onChange=${(/** @type {Changed} */ e) => use(e.target.value)}
      >
        <option value="">
          ${all.length ? t("pair.calibration.without") : t("pair.calibration.none-kept")}
        </option>
        ${all.map((c) => html`<option key=${c.id} value=${c.id}>
          ${title(c)}
        </option>`)}
      </select>
    </label>
    ${own === null && now && 
      html`<p class="reason">
        ${now.active ? t("pair.calibration.proposed-active") : t("pair.calibration.proposed-made")}
      </p>`}
  </div>`;
}

/** @param {{ index: number }} props */
function Row({ index }) {
  const match = pair.doc.value.matches[index],
    { px, mm: apart, isMistake } = matchErrors.value[index] ?? {},
    waits = !(match.a && match.b);
  return html`<li data-testid=${`match-${index + 1}`} data-mistake=${isMistake}>
    <button
      type="button"
      class="feature"
      aria-pressed=${chosen.value?.index === index}
      onClick=${() => choose(index)}
      title=${t("pair.match.show", { match: index + 1 })}
    >
      <i class=${`chip${waits ? " waits" : isMistake ? " mistake" : ""}`}>${index + 1}</i>
      <span>
        ${waits
          ? (
          t(`pair.match.wants.${match.a ? "b" : "a"}`)
        )
          : html`
            <b>${px === null || px === undefined ? "–" : `${number(px, 2)} px`}</b>
            ${apart !== null && apart !== undefined && html`<em>${mm(apart)} mm</em>`}
            ${isMistake && html`<b class="level fair">${t("pair.match.mistake")}</b>`}
          `}
      </span>
    </button>
    <${Height}
      name=${`height-${index + 1}`}
      label=${t("pair.height.of-match", { match: index + 1 })}
      value=${match.z_mm}
      set=${(/** @type {number | null} */ z) => setHeight(index, z)}
    />
    <button
      type="button"
      class="remove"
      aria-label=${t("pair.match.remove", { match: index + 1 })}
      title=${t("pair.match.remove.title")}
      onClick=${() => removeMatch(index)}
    >
      ×
    </button>
  </li>`;
}

/** @param {{ name: string, label: string, value: number | null, set: (z: number | null) => void }} props */
const Height = ({ name, label, value, set }) => html`<span class="with-unit">
  <${Typed}
    type="number"
    data-testid=${name}
    aria-label=${label}
    min="0"
    max="5000"
    step="any"
    placeholder="?"
    value=${value ?? ""}
    take=${(/** @type {string} */ text) => {
      const z = text === "" ? null : Number(text);
      if (z === null || (z >= 0 && z <= 5000)) set(z);
    }}
  />
  <small>mm</small>
</span>`;
