// Left of two images: when they were taken, how high things are, and every match with its figures.
import { dayAndTime, mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { Typed } from "../../../ui/typed.js";
import { Working } from "../../../ui/working.js";
import { SIDES, chosen, desk, hatMm, members, nextHeight, pictures } from "../match_desk.js";
import { matchErrors } from "../match_lines.js";
import { choose, removeMatch, setHeight } from "../matches.js";
import { refusal, rig, search } from "../rig.js";

export function MatchList() {
  const { matches } = desk.doc.value,
    it = rig.value;
  if (!it || !members.value) return null;
  return html`
    <section aria-label=${t("rig.match.images")}>
      <a href=${addressOf("rig", { rig: it.name })} data-testid="to-rig">‹ ${it.title || it.name}</a>
      <${Title} of="matches">${t("rig.match.images")}<//>
      <dl class="details taken">
        ${SIDES.map(
          (s) => html`<div key=${s}>
          <dt>${members.value?.[s].title}</dt>
          <dd>${pictures.value[s] ? dayAndTime(pictures.value[s].taken_at) : "–"}</dd>
        </div>`,
        )}
      </dl>
      <${ActionButton} id="take-match-images" />
      ${matches.length > 0 && html`<p class="reason">${t("rig.match.take.what")}</p>`}
      <${Working} now=${search.value} what=${t("rig.checking")} stop="stop-rig" why=${refusal.value} name="rig" />
    </section>
    <section aria-label=${t("rig.match.list")}>
      <h2>${t("rig.match.count", { count: matches.length })}</h2>
      <label class="pair length">
        <span>${t("rig.match.height.next")}</span>
        <${Height}
          name="next-height"
          value=${nextHeight.value}
          label=${t("rig.match.height.next.label")}
          set=${(/** @type {number | null} */ z) => {
            nextHeight.value = z;
          }}
        />
      </label>
      <p class="reason" data-testid="match-heights">${t("rig.match.height.what", { hat: hatMm.value })}</p>
      <ol class="matches" data-testid="matches">
        ${matches.map((_, index) => html`<${Row} key=${index} index=${index} />`)}
      </ol>
    </section>
  `;
}

/** @param {{ index: number }} props */
function Row({ index }) {
  const match = desk.doc.value.matches[index],
    { px, mm: apart, isMistake } = matchErrors.value[index],
    waits = !(match.a && match.b),
    lacking = members.value?.[match.a ? "b" : "a"].title ?? "";
  return html`<li data-testid=${`match-${index + 1}`} data-mistake=${isMistake}>
    <button
      type="button"
      class="feature"
      aria-pressed=${chosen.value?.index === index}
      onClick=${() => choose(index)}
      title=${t("rig.match.show", { match: index + 1 })}
    >
      <i class=${`chip${waits ? " waits" : isMistake ? " mistake" : ""}`}>${index + 1}</i>
      <span>
        ${
          waits
            ? t("rig.match.lacks", { camera: lacking })
            : html`
            <b>${px === null ? "–" : `${number(px, 2)} px`}</b>
            ${apart !== null && html`<em>${mm(apart)} mm</em>`}
            ${isMistake && html`<b class="level fair">${t("rig.match.outlier")}</b>`}
          `
        }
      </span>
    </button>
    <${Height}
      name=${`height-${index + 1}`}
      label=${t("rig.match.height.of", { match: index + 1 })}
      value=${match.z_mm}
      set=${(/** @type {number | null} */ z) => setHeight(index, z)}
    />
    <button
      type="button"
      class="remove"
      aria-label=${t("rig.match.remove", { match: index + 1 })}
      title=${t("rig.match.remove", { match: index + 1 })}
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
