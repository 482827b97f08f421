// The field from above: each camera that goes out with its number and error, and why others do not.
import { shortened } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { cameras, fields } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { FieldAreas } from "../../../ui/field_plan.js";

const NAME = 20; // characters of a camera's name
/** Why a camera is not sent, in a few words. @type {Record<string, string>} */
const WHY = {
  "number-taken": t("network.plan.number-taken"),
  "loss-above-limit": t("network.plan.above-limit"),
  "other-field": t("network.plan.other-field"),
  "field-changed": t("network.plan.field-changed"),
};

/**
 * @typedef {import("../types").PublishedCamera} PublishedCamera
 * @typedef {import("../../../core/types").Field} Field
 * @typedef {{ id: string, name: string, field: string, area: string | null, sent: PublishedCamera | null,
 *   why: string }} Shown
 */

/** One drawing for each field.
 * @param {{ it: import("../types").Publishing, error: (camera: PublishedCamera) => string }} props */
export function SentPlan({ it: { cameras: all, members }, error }) {
  const shown = cameras.value
    .filter((c) => members.includes(c.id))
    .map((c) =>
      shownOf(
        c,
        all.find(({ camera }) => camera === c.id),
      ),
    );
  const isDrawn = (/** @type {Shown} */ it) => fields.value.some(({ name }) => name === it.field);
  return html`<div class="sent-plans">
    ${fields.value
      .filter(({ name }) => shown.some(({ field }) => field === name))
      .map(
        (field) => html`<figure
          key=${field.name}
          class=${all.some((c) => c.published && c.field === field.name) ? "" : "silent"}
          data-testid=${`plan-${field.name}`}
        >
        <${OneField} field=${field} shown=${shown.filter((it) => it.field === field.name)} error=${error} />
        <figcaption class="reason">${field.title}</figcaption>
      </figure>`,
      )}
    <${NotDrawn} shown=${shown.filter((it) => !isDrawn(it))} error=${error} />
  </div>`;
}

/** @param {import("../../../core/types").Camera} camera @param {PublishedCamera} [it] @returns {Shown} */
function shownOf({ id, name, field, region }, it) {
  const problem = it?.problem?.reason ?? "";
  return {
    id,
    name,
    field: it?.field ?? field ?? "",
    area: it?.region ?? region,
    sent: it?.published ? it : null,
    why: !it ? t("network.plan.uncalibrated") : (WHY[problem] ?? t("network.sent.left-out")),
  };
}

/** @param {{ field: Field, shown: Shown[], error: (camera: PublishedCamera) => string }} props */
const OneField = ({ field, shown, error }) => html`<${FieldAreas}
  field=${field}
  label=${t("network.plan.what", { field: field.title })}
  areas=${shown.map(({ id, name, area, sent, why }) => ({
    key: id,
    testid: `plan-of-${id}`,
    area: field.regions[area ?? ""] ?? Object.values(field.regions)[0],
    isAbsent: !sent,
    level: sent?.level,
    text: html`<b title=${name}>${numberOf(sent)}${shortened(name, NAME)}</b>
      <small>${sent ? t("network.plan.error", { error: error(sent) }) : why}</small>`,
  }))}
/>`;

/** @param {PublishedCamera | null} sent */
const numberOf = (sent) => (sent ? `${sent.camera_id} · ` : "");

/** Cameras of no field that this server knows.
 * @param {{ shown: Shown[], error: (camera: PublishedCamera) => string }} props */
const NotDrawn = ({ shown, error }) =>
  shown.length > 0 &&
  html`<ul class="plain">
  ${shown.map(
    ({ id, name, field, sent, why }) => html`<li key=${id} data-testid=${`plan-without-${id}`}>
    <b>${numberOf(sent)}${name}</b>
    <small> ${sent ? t("network.plan.error", { error: error(sent) }) : why}</small>
    <small class="where">
      ${field ? t("network.plan.unknown-field", { field }) : t("network.plan.no-field")}
    </small>
  </li>`,
  )}
</ul>`;
