// A rolling ball: tracks over the picture, each roll with its number, sag in nine zones, and the fitted lens.
import { call } from "../../../core/api.js";
import { ago, number, pct, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf, go } from "../../../core/route.js";
import { notifyError } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Title } from "../../../ui/title.js";
import { Working } from "../../../ui/working.js";
import { path } from "../../../canvas/drawing.js";
import { useLens } from "../../board/board.js";
import { LiveView } from "../../live/layers/live_view.js";
import {
  all,
  counted,
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
import { KINDS } from "../../straight/panels/straight.js";

/** @typedef {import("../types").SavedRoll} SavedRoll */

const WIDTH_PX = 960;
const LEVELS = {
  good: "straight",
  fair: "within a standard lens' ±3 %",
  poor: "beyond it",
  "left-out": "not counted",
  unknown: "cannot be told",
};

export function RollsPage() {
  const camera = rollsCamera.value;
  if (!camera) return null;
  const now = movingTracks.value,
    list = rolls.value;
  return html`<div class="page" data-testid="rolls-page">
    <h1>A ball before ${camera.name}</h1>
    <p class="dim">
      What rolls freely goes straight over the carpet; how far its track bows in the picture is distortion.
    </p>
    <div class="captured rolls">
      <${LiveView} key=${camera.id} id=${camera.id} name=${camera.name} width=${WIDTH_PX} />
      ${now && html`<svg class="over" viewBox=${`-0.5 -0.5 ${now.width} ${now.height}`} aria-hidden="true">
        ${list
          .toReversed()
          .map(
            (roll) =>
              roll.counts && html`<path
                key=${roll.id}
                class=${pointed.value === roll.id ? "pointed" : ""}
                data-level=${levelOf(roll)}
                data-testid="roll-track"
                d=${path(roll.points)}
              />`,
          )}
        ${now.tracks.map((track, i) => 
          html`<path key=${i} class="now" data-testid="roll-now" d=${path(track)} />`)}
      </svg>`}
    </div>
    <p class="rolls-key" aria-hidden="true">
      ${Object.entries(LEVELS).map(([name, words]) => html`<span key=${name}>
        <i data-level=${name}></i>
        ${words}
      </span>`)}
    </p>
    <p class="hint-line" role="status" data-testid="rolls-hint">
      ${refusal.value
        ? html`
          <b>${refusal.value.detail}</b> ${refusal.value.fix}
        `
        : !now
        ? (
        "Waiting for the camera…"
      )
        : (
        now.hint || newest(list[0])
      )}
    </p>
    <div class="line wrap">
      <${ActionButton} id="leave-roll" withKey />
      <${ActionButton} id="take-roll" />
      <${ActionButton}
        id="forget-rolls"
        label=${forgetting.value ? `Press again to forget ${plural(list.length, "roll")}` : "Forget all…"}
      />
    </div>
    <ol class="rolls" reversed data-testid="rolls" aria-label="Rolls, newest first">
      ${list.map((roll, i) => html`<${Row} key=${roll.id} roll=${roll} name=${list.length - i} />`)}
    </ol>
  </div>`;
}

/** @param {SavedRoll} roll */
const levelOf = (roll) => (roll.left_out ? "left-out" : (roll[view.value]?.level ?? "unknown"));

/** @param {SavedRoll | undefined} roll */
const newest = (roll) =>
  !roll
    ? (
    "Let a ball roll across the field."
  )
    : html`
      Newest: <b>${numberOf(roll)}</b> ${wordsOf(roll)}
    `;

/** @param {SavedRoll} roll */
function numberOf(roll) {
  const it = roll[view.value];
  return it ? `${pct(it.bow_pct)} ± ${number(it.spread_pct, 2)} %` : "–";
}

/** @param {SavedRoll} roll */
const wordsOf = (roll) =>
  roll.left_out
    ? "Left out by you."
    : !roll.counts
      ? "Of pictures of another size: not counted."
      : (roll[view.value]?.words ?? "Out of the corrected picture.");

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
    ${number(roll[view.value]?.length_px, 0)} px in ${number(roll.seconds, 1)} s,${" "}
    ${ago(roll.at * 1000, Date.now())}
  </small>
  <button
    type="button"
    data-testid="roll-leave"
    aria-label=${`${roll.left_out ? "Take in again" : "Leave out"} roll ${name}`}
    onFocus=${() => {
      pointed.value = roll.id;
    }}
    onClick=${() => void excludeRoll(roll.id, !roll.left_out)}
  >
    ${roll.left_out ? "Take in again" : "Leave out"}
  </button>
</li>`;

/** On the left: how to roll, and what may be made of it. */
export function RollsForm() {
  return html`
    <section>
      <${Title} of="rolls">Good rolls<//>
      <ul class="plain">
        <li>
          <b>One ball, nobody else</b>: robots drive curves.
        </li>
        <li>
          <b>Quick</b>: spin and slope push a slow ball aside.
        </li>
        <li>
          <b>Near the borders</b>, in several directions: through the middle a line is straight behind any
          lens.
        </li>
        <li>
          <b>Five</b> are worth having.
        </li>
      </ul>
    </section>
    <section aria-label="Lens">
      <h2>A lens from them</h2>
      <label class="pair tall">
        <span>Kind</span>
        <select
          data-testid="rolls-kind"
          value=${kind.value}
          onChange=${(/** @type {any} */ e) => {
            kind.value = e.target.value;
          }}
        >
          ${KINDS.map(([id, label]) => html`<option key=${id} value=${id}>
            ${label}
          </option>`)}
        </select>
      </label>
      <p class="reason">${KINDS.find(([id]) => id === kind.value)?.[2]}</p>
      <div class="line wrap">
        <${ActionButton} id="fit-rolls" />
        <${ActionButton} id="refine-rolls" />
      </div>
      <p class="reason">
        ${hasCorrected.value
          ? "Refining fits the active calibration anew to its own clicks and these rolls; the new version is not " +
            "made active."
          : "With an active calibration it can be refined as well."}
      </p>
      <${Working}
        now=${search.value}
        what="Fitting the rolls"
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
      <b class="level good">A new version is saved</b>, not active.${" "}
      <a href=${addressOf("versions", { camera: camera.id })}>Look at the versions</a>
    </p>`;
  return html`
    <p class="reason" data-testid="rolls-made">
      <b class="level good">The lens is kept.</b>
    </p>
    <button type="button" data-testid="use-roll-lens" onClick=${() => void hold(it.lens ?? "")}>
      Use this lens next
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
  const both = hasCorrected.value && html`<div class="switch" role="group" aria-label="Judge">
    ${["raw", "corrected"].map((name) => html`<button
      key=${name}
      type="button"
      data-testid=${`rolls-${name}`}
      aria-pressed=${String(which === name)}
      onClick=${() => {
        wantsCorrected.value = name === "corrected";
      }}
    >
      ${name === "raw" ? "Raw" : "Corrected"}
    </button>`)}
  </div>`;
  if (!it || !counted.value.length)
    return html`<section aria-label="Distortion">
      <${Title} of="rolls-all">Along the edge<//>
      ${both}
      <p class="reason">It is told as soon as something has rolled straight.</p>
    </section>`;
  return html`
    <section aria-label="Distortion">
      <${Title} of="rolls-all">Along the edge<//>
      ${both}
      <p class=${`rolls-big level ${level.value}`} data-testid="rolls-pct">
        ${pct(it.border_pct)} ± ${number(it.border_sigma_pct, 2)} %
      </p>
      <p data-testid="rolls-sentence">${it.sentence}</p>
    </section>
    <section aria-label="Nine fields of the picture">
      <h2>Where it bows</h2>
      <${Zones} zones=${it.zones} />
    </section>
  `;
}

/** @param {{ zones: (import("../types").SagZone | null)[][] }} props */
const Zones = ({ zones }) => html`<table class="zones" data-testid="zones">
  <caption class="sr">Bow by the part of the picture, %</caption>
  <tbody>
    ${zones.map((row, y) => html`<tr key=${y}>
      ${row.map((zone, x) => html`<td
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
        title=${zone ? plural(zone.rolls, "roll") : "Nothing rolled here yet"}
      >
        ${zone
          ? html`
            ${pct(zone.pct)}
            <small>± ${number(zone.sigma_pct, 2)}</small>
          `
          : (
          "–"
        )}
      </td>`)}
    </tr>`)}
  </tbody>
</table>`;
