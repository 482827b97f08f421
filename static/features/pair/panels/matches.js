// Left of two pictures: where they come from, their calibrations, how high things are, and every match with its
// figures.
import { dayAndTime, mm, number, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { models } from "../../../core/state.js";
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
  sideName,
  sourceOf,
  suitedCalibrations,
} from "../pair.js";

/** @typedef {import("../types").Side} Side @typedef {{ target: HTMLInputElement & HTMLSelectElement }} Changed */

export function PairForm() {
  const { matches } = pair.doc.value;
  return html`
    <section aria-label="Pictures">
      <${Title} of="pair">Pictures<//>
      ${SIDES.map((s) => html`<${Picture} key=${s} s=${s} />`)}
    </section>
    <section aria-label="Matches">
      <h2>${plural(matches.length, "match").replace("matchs", "matches")}</h2>
      <label class="pair length">
        <span>Height of the next one</span>
        <${Height}
          name="next-height"
          value=${nextHeight.value}
          label="Height of the next match, mm"
          set=${(/** @type {number | null} */ z) => {
            nextHeight.value = z;
          }}
        />
      </label>
      <p class="reason" data-testid="pair-heights">
        0 mm on the carpet,${" "}
        ${hatMm.value === null ? "a robot's hat as its league has it" : `${hatMm.value} mm a robot's hat`}.
        Empty: not known; it tells how the cameras stand, not whether they agree.
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
      <b>${s === "a" ? "Left" : "Right"}:</b> not chosen yet.
    </p>`;
  /** @param {string} id */
  const use = (id) =>
    pair.change({ ...pair.doc.value, calibrations: { ...pair.doc.value.calibrations, [s]: id } });
  const title = (/** @type {import("../../../core/types").Calibration} */ c) =>
    `Version ${c.version}, ${models.value.find((m) => m.name === c.model.name)?.title ?? c.model.name}, ` +
      `${dayAndTime(c.created_at)}${c.active ? ", active" : ""}`;
  return html`<div class="pair-picture">
    <div class="line">
      <b>${s === "a" ? "Left" : "Right"}</b>
      <small>
        ${sourceOf(s)}, ${it.width} × ${it.height} px
      </small>
      <button type="button" data-testid=${`another-${s}`} onClick=${() => setPicture(s, null)}>
        Choose another…
      </button>
    </div>
    <label class="pair tall">
      <span class="sr">Calibration of the ${sideName(s)} picture</span>
      <select
        data-testid=${`calibration-${s}`}
        value=${now?.id ?? ""}
        disabled=${!all.length}
        onChange=${(/** @type {Changed} */ e) => use(e.target.value)}
      >
        <option value="">
          ${all.length ? "Without a calibration" : "No calibration of this size is kept"}
        </option>
        ${all.map((c) => html`<option key=${c.id} value=${c.id}>
          ${title(c)}
        </option>`)}
      </select>
    </label>
    ${own === null && now && 
      html`<p class="reason">${now.active ? "The active one, proposed." : "Made from this picture, proposed."}</p>`}
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
      title=${`Show match ${index + 1}`}
    >
      <i class=${`chip${waits ? " waits" : isMistake ? " mistake" : ""}`}>${index + 1}</i>
      <span>
        ${waits
          ? (
          `wants the ${match.a ? "right" : "left"} point`
        )
          : html`
            <b>${px === null || px === undefined ? "–" : `${number(px, 2)} px`}</b>
            ${apart !== null && apart !== undefined && html`<em>${mm(apart)} mm</em>`}
            ${isMistake && html`<b class="level fair">mistake?</b>`}
          `}
      </span>
    </button>
    <${Height}
      name=${`height-${index + 1}`}
      label=${`Height of match ${index + 1}, mm`}
      value=${match.z_mm}
      set=${(/** @type {number | null} */ z) => setHeight(index, z)}
    />
    <button
      type="button"
      class="remove"
      aria-label=${`Remove match ${index + 1}`}
      title="Remove this match"
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
