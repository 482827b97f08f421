// A rolling ball: tracks over the picture, each roll with its number, sag in nine zones, and the fitted lens.
import { call } from "../../../core/api.js";
import { ago, number, pct } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf, go } from "../../../core/route.js";
import { notifyError } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { rich } from "../../../ui/rich.js";
import { Title } from "../../../ui/title.js";
import { Working } from "../../../ui/working.js";
import { path } from "../../../canvas/drawing.js";
import { useLens } from "../../boards/board.js";
import { publishDeceleration } from "../../league/measured_ball.js";
import { LiveView } from "../../live/layers/live_view.js";
import {
  all,
  counted,
  deceleration,
  excludeRoll,
  fittedLens,
  forgetting,
  hasCorrected,
  kind,
  level,
  movingTracks,
  pointed,
  refusal,
  rolls,
  rollsCamera,
  search,
  view,
  wantsCorrected,
  workRefusal,
} from "../rolls.js";
import { KINDS } from "./straight.js";

/** @typedef {import("../types").SavedRoll} SavedRoll */

const WIDTH_PX = 960;
const LEVELS = {
  good: t("rolling.level.good"),
  fair: t("rolling.level.fair"),
  poor: t("rolling.level.poor"),
  "left-out": t("rolling.level.left-out"),
  unknown: t("rolling.level.unknown"),
};

export function RollsPage() {
  const camera = rollsCamera.value;
  if (!camera) return null;
  const now = movingTracks.value,
    list = rolls.value;
  return html`<div class="page" data-testid="rolls-page">
    <h1>${t("rolling.page.title", { camera: camera.name })}</h1>
    <p class="dim">
      ${t("rolling.page.purpose")}
    </p>
    <div class="captured rolls">
      <${LiveView} key=${camera.id} id=${camera.id} name=${camera.name} width=${WIDTH_PX} />
      ${
        now &&
        html`<svg class="over" viewBox=${`-0.5 -0.5 ${now.width} ${now.height}`} aria-hidden="true">
        ${list.toReversed().map(
          (roll) =>
            roll.counts &&
            html`<path
                key=${roll.id}
                class=${pointed.value === roll.id ? "pointed" : ""}
                data-level=${levelOf(roll)}
                data-testid="roll-track"
                d=${path(roll.points)}
              />`,
        )}
        ${now.tracks.map(
          (track, i) => html`<path key=${i} class="now" data-testid="roll-now" d=${path(track)} />`,
        )}
      </svg>`
      }
    </div>
    <p class="rolls-key" aria-hidden="true">
      ${Object.entries(LEVELS).map(
        ([name, words]) => html`<span key=${name}>
        <i data-level=${name}></i>
        ${words}
      </span>`,
      )}
    </p>
    <p class="hint-line" role="status" data-testid="rolls-hint">
      ${
        refusal.value
          ? html`
          <b>${refusal.value.detail}</b> ${refusal.value.fix}
        `
          : !now
            ? t("lens-pictures.waiting-for-camera")
            : now.hint || newest(list[0])
      }
    </p>
    <div class="line wrap">
      <${ActionButton} id="leave-roll" withKey />
      <${ActionButton} id="take-roll" />
      <${ActionButton}
        id="forget-rolls"
        label=${
          forgetting.value
            ? t("rolling.page.press-again", { count: list.length })
            : t("rolling.forget-all")
        }
      />
    </div>
    <ol class="rolls" reversed data-testid="rolls" aria-label=${t("rolling.page.list")}>
      ${list.map((roll, i) => html`<${Row} key=${roll.id} roll=${roll} name=${list.length - i} />`)}
    </ol>
  </div>`;
}

/** @param {SavedRoll} roll */
const levelOf = (roll) => (roll.left_out ? "left-out" : (roll[view.value]?.level ?? "unknown"));

/** @param {SavedRoll | undefined} roll */
const newest = (roll) =>
  !roll
    ? t("rolling.page.let-roll")
    : rich("rolling.page.newest", { bow: numberOf(roll), judgement: wordsOf(roll) });

/** @param {SavedRoll} roll */
function numberOf(roll) {
  const it = roll[view.value];
  return it ? `${pct(it.bow_pct)} ± ${number(it.spread_pct, 2)} %` : "–";
}

/** @param {SavedRoll} roll */
const wordsOf = (roll) =>
  roll.left_out
    ? t("rolling.roll.left-out")
    : !roll.counts
      ? t("rolling.roll.another-size")
      : (roll[view.value]?.words ?? t("rolling.roll.out-of-picture"));

/** @param {{ roll: SavedRoll, name: number }} props */
const Row = ({ roll, name }) => html`<li
  data-testid="roll"
  data-level=${levelOf(roll)}
  class=${pointed.value === roll.id ? "pointed" : ""}
  onPointerEnter=${() => {
    pointed.value = roll.id;
  }}
  onPointerLeave=${() => {
    pointed.value = "";
  }}
>
  <span class="dim">${name}</span>
  <b class="value">${numberOf(roll)}</b>
  <span class="words">${wordsOf(roll)}</span>
  <small>
    ${t("rolling.roll.details", {
      length: number(roll[view.value]?.length_px, 0),
      seconds: number(roll.seconds, 1),
      when: ago(roll.at * 1000, Date.now()),
    })}
  </small>
  <button
    type="button"
    data-testid="roll-leave"
    aria-label=${
      roll.left_out
        ? t("rolling.roll.take-in-number", { number: name })
        : t("rolling.roll.leave-out-number", { number: name })
    }
    onFocus=${() => {
      pointed.value = roll.id;
    }}
    onClick=${() => void excludeRoll(roll.id, !roll.left_out)}
  >
    ${roll.left_out ? t("rolling.roll.take-in") : t("rolling.roll.leave-out")}
  </button>
</li>`;

/** On the left: how to roll, and what may be made of it. */
export function RollsForm() {
  return html`
    <section>
      <${Title} of="rolls">${t("rolling.good-rolls.title")}<//>
      <ul class="plain">
        <li>${rich("rolling.good-rolls.one-ball")}</li>
        <li>${rich("rolling.good-rolls.quick")}</li>
        <li>${rich("rolling.good-rolls.borders")}</li>
        <li>${rich("rolling.good-rolls.five")}</li>
      </ul>
    </section>
    <section aria-label=${t("lens-pictures.lens")}>
      <h2>${t("rolling.fit.title")}</h2>
      <label class="pair tall">
        <span>${t("straight.lens-kind")}</span>
        <select
          data-testid="rolls-kind"
          value=${kind.value}
          onChange=${(/** @type {any} */ e) => {
            kind.value = e.target.value;
          }}
        >
          ${KINDS.map(
            ([id, label]) => html`<option key=${id} value=${id}>
            ${label}
          </option>`,
          )}
        </select>
      </label>
      <p class="reason">${KINDS.find(([id]) => id === kind.value)?.[2]}</p>
      <div class="line wrap">
        <${ActionButton} id="fit-rolls" />
        <${ActionButton} id="refine-rolls" />
      </div>
      <p class="reason">
        ${hasCorrected.value ? t("rolling.fit.refining") : t("rolling.fit.refining-needs-active")}
      </p>
      <${Working}
        now=${search.value}
        what=${t("rolling.fit.working")}
        stop="stop-rolls"
        why=${workRefusal.value}
        name="rolls"
      />
      <${Made} />
    </section>
  `;
}

/** What came of it, and where it is. */
function Made() {
  const it = fittedLens.value,
    camera = rollsCamera.value;
  if (!it || !camera) return null;
  if (it.calibration)
    return html`<p class="reason" data-testid="rolls-made">
      ${rich("rolling.made.version", {
        saved: html`<b class="level good">${t("rolling.made.version-saved")}</b>`,
      })}${" "}
      <a href=${addressOf("versions", { camera: camera.id })}>${t("rolling.made.look")}</a>
    </p>`;
  return html`
    <p class="reason" data-testid="rolls-made">
      <b class="level good">${t("rolling.made.lens")}</b>
    </p>
    <button type="button" data-testid="use-roll-lens" onClick=${() => void hold(it.lens ?? "")}>
      ${t("rolling.made.use-lens")}
    </button>
  `;
}

/** @param {string} id */
async function hold(id) {
  try {
    useLens(await call("GET", `/lenses/${id}`));
    go("wall");
  } catch (error) {
    notifyError(error);
  }
}

/** On the right: what all of them say. */
export function RollsReport() {
  const it = all.value,
    which = view.value;
  const both =
    hasCorrected.value &&
    html`<div class="switch" role="group" aria-label=${t("rolling.report.judge")}>
    ${["raw", "corrected"].map(
      (name) => html`<button
      key=${name}
      type="button"
      data-testid=${`rolls-${name}`}
      aria-pressed=${String(which === name)}
      onClick=${() => {
        wantsCorrected.value = name === "corrected";
      }}
    >
      ${name === "raw" ? t("common.raw") : t("common.corrected")}
    </button>`,
    )}
  </div>`;
  if (!it || !counted.value.length)
    return html`<section aria-label=${t("common.distortion")}>
      <${Title} of="rolls-all">${t("rolling.report.title")}<//>
      ${both}
      <p class="reason">${t("rolling.report.not-yet")}</p>
    </section>`;
  return html`
    <section aria-label=${t("common.distortion")}>
      <${Title} of="rolls-all">${t("rolling.report.title")}<//>
      ${both}
      <p class=${`rolls-big level ${level.value}`} data-testid="rolls-pct">
        ${pct(it.border_pct)} ± ${number(it.border_sigma_pct, 2)} %
      </p>
      <p data-testid="rolls-sentence">${it.sentence}</p>
    </section>
    <section aria-label=${t("rolling.zones.label")}>
      <h2>${t("rolling.zones.title")}</h2>
      <${Zones} zones=${it.zones} />
    </section>
    <${Deceleration} />
  `;
}

/** How the ball slows down, for the geometry that teams receive. */
function Deceleration() {
  const it = deceleration.value,
    camera = rollsCamera.value;
  if (!it || !camera) return null;
  return html`<section aria-label=${t("rolling.deceleration")}>
    <h2>${t("rolling.deceleration")}</h2>
    <p data-testid="deceleration">${it.sentence}</p>
    ${
      it.acc_roll &&
      html`<button
      type="button"
      data-testid="use-deceleration"
      title=${t("rolling.deceleration.hint")}
      onClick=${() => void publishDeceleration(camera.id, it)}
    >
      ${t("rolling.deceleration.use")}
    </button>`
    }
  </section>`;
}

/** @param {{ zones: (import("../types").SagZone | null)[][] }} props */
const Zones = ({ zones }) => html`<table class="zones" data-testid="zones">
  <caption class="sr">${t("rolling.zones.caption")}</caption>
  <tbody>
    ${zones.map(
      (row, y) => html`<tr key=${y}>
      ${row.map(
        (zone, x) => html`<td
        key=${x}
        data-level=${
          !zone
            ? "none"
            : Math.abs(zone.pct) <= 2 * zone.sigma_pct
              ? "good"
              : Math.abs(zone.pct) <= 3
                ? "fair"
                : "poor"
        }
        title=${zone ? t("rolling.zones.rolls", { count: zone.rolls }) : t("rolling.zones.none")}
      >
        ${
          zone
            ? html`
            ${pct(zone.pct)}
            <small>± ${number(zone.sigma_pct, 2)}</small>
          `
            : "–"
        }
      </td>`,
      )}
    </tr>`,
    )}
  </tbody>
</table>`;
