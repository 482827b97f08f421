// Every version of a camera: the active one, the former one, the difference of two.
import { useEffect } from "preact/hooks";
import { address } from "../../../core/api.js";
import { dayAndTime, mm, number, words } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf, route } from "../../../core/route.js";
import { cameras, models } from "../../../core/state.js";
import { Typed } from "../../../ui/typed.js";
import { activateCalibration } from "../activate.js";
import {
  activeVersion,
  annotate,
  choose,
  comparedPair,
  deleteVersion,
  formerVersion,
  listedCamera,
  loadMore,
  loadVersionList,
  pairDifference,
  versionList,
} from "../version_list.js";
import { changesInWords } from "../outdated.js";
import { ExportMenu } from "./exports.js";
import { Outdated } from "./outdated.js";

/** @typedef {import("../types").VersionRecord} Kept */

export function VersionListPage() {
  const camera = listedCamera.value,
    it = versionList.value?.camera === camera ? versionList.value : null;
  useEffect(() => {
    void loadVersionList(camera);
  }, [camera]);
  return html`<div class="page wide" data-testid="versions-page">
    <h1>Saved versions</h1>
    ${route.value.place === "library" && html`<nav class="tabs desks" aria-label="Of which camera">
      ${[...cameras.value, { id: "", name: "Pictures from files" }].map(({ id, name }) => html`<a
        key=${id}
        class="tab"
        href=${addressOf("versions", { camera: id })}
        data-testid=${`shelf-${id || "files"}`}
        aria-current=${id === camera ? "page" : undefined}
      >
        ${name}
      </a>`)}
    </nav>`}
    ${!it
      ? html`<p class="dim">Asking the server…</p>`
      : html`
        ${camera && html`<${Outdated} camera=${camera} />`}
        <${RollBack} />
        ${it.items.length
          ? html`<ul class="shelf" data-testid="shelf">
            ${it.items.map((v) => html`<${Version} key=${v.id} it=${v} />`)}
          </ul>`
          : html`<p class="dim">
            Nothing is saved here yet.${" "}
            <a href=${addressOf("wall")}>Take or open a picture</a>, click its borders and save.
          </p>`}
        ${it.next && html`<button type="button" onClick=${() => void loadMore()}>
          Show older ones
        </button>`}
      `}
  </div>`;
}

/** The way back is always in sight. */
function RollBack() {
  const before = formerVersion.value,
    now = activeVersion.value;
  if (!before || !now) return null;
  return html`<div class="plainly line" data-testid="roll-back">
    <span class="grow">
      Version <b>${now.version}</b> is active; before it was version <b>${before.version}</b>
      ${before.by && `, chosen by ${before.by}`}.
    </span>
    <button
      type="button"
      data-testid="do-roll-back"
      onClick=${() =>
        void activateCalibration({ id: before.calibration, version: before.version, camera: now.camera })}
    >
      Go back to version ${before.version}
    </button>
  </div>`;
}

/** @param {{ it: Kept }} props */
function Version({ it }) {
  const { id, version, active, camera, snapshot, report, field_changes: changes = [] } = it,
    model = models.value.find((m) => m.name === it.model.name)?.title ?? it.model.name;
  const isChosen = comparedPair.value.includes(id);
  return html`<li
    class=${`card${active ? " now" : ""}`}
    data-testid="shelf-version"
    data-version=${version}
    data-active=${String(active)}
  >
    <div class="line">
      <b>Version ${version}</b>
      ${active && html`<b class="level good">Active</b>`}
      <span class=${`level ${report.verdict.level}`}>${mm(report.verdict.mm)} mm</span>
      ${changes.length > 0 && html`<b
        class="level poor"
        data-testid="field-changed"
        title=${`Elsewhere now: ${changesInWords(changes)}`}
      >
        Field changed since
      </b>`}
      <small class="grow">
        ${model}, ${words(it.region).toLowerCase()}; ${dayAndTime(it.created_at)}
        ${it.made_by && `, by ${it.made_by}`}
      </small>
    </div>
    <${Typed}
      type="text"
      class="note"
      data-testid="shelf-note"
      maxlength="2000"
      aria-label=${`Note for version ${version}`}
      placeholder="Add a note"
      value=${it.note}
      take=${(/** @type {string} */ text) => annotate(it, text)}
    />
    <div class="line wrap">
      ${camera && !active && 
        html`<button type="button" data-testid="shelf-activate" onClick=${() => void activateCalibration(it)}>
          Activate
        </button>`}
      ${snapshot && html`<a
        href=${addressOf("calibrate", { picture: snapshot, step: "verify" })}
        data-testid="shelf-open"
      >
        Open its picture
      </a>`}
      <a href=${address(`/calibrations/${id}/report.html`)} target="_blank" rel="noopener">
        Open report
      </a>
      <a href=${addressOf("scene", { scene: id })} data-testid="shelf-scene">
        Scene in 3-D
      </a>
      <a href=${address(`/calibrations/${id}/export/json`)} download=${`touchline-v${version}.json`}>
        Download (JSON)
      </a>
      <label class="line">
        <input type="checkbox" data-testid="shelf-compare" checked=${isChosen} onChange=${() => choose(id)} />${" "}
        compare
      </label>
      <button
        type="button"
        data-testid="shelf-delete"
        disabled=${active}
        title=${active ? "Activate another version first." : `Delete version ${version}; it can be put back`}
        onClick=${() => void deleteVersion(it)}
      >
        Delete
      </button>
    </div>
    <${ExportMenu} it=${it} />
  </li>`;
}

/** On the right: two compared, and what was active when. */
export function VersionListReport() {
  const it = versionList.value;
  return html`
    <${Two} />
    <section aria-label="History">
      <h2>What was active</h2>
      ${it?.history.length
        ? html`<ol class="plain history" data-testid="history">
          ${it.history.map((h) => html`<li key=${h.at + h.calibration}>
            <b>${h.version === null ? "A deleted version" : `Version ${h.version}`}</b>
            <small>
              ${dayAndTime(h.at)}
              ${h.by && `, by ${h.by}`}
            </small>
          </li>`)}
        </ol>`
        : html`<p class="reason">Nothing was activated yet.</p>`}
    </section>
  `;
}

function Two() {
  const ids = comparedPair.value,
    at = pairDifference.value,
    of2 = ids.map((id) => versionList.value?.items.find((v) => v.id === id)?.version ?? "?");
  if (ids.length < 2)
    return html`<section>
      <h2>Compare two versions</h2>
      <p class="reason">Tick “compare” at two of them.</p>
    </section>`;
  return html`<section aria-label="Two versions compared" data-testid="apart">
    <h2>
      Versions ${of2[0]} and ${of2[1]}
    </h2>
    ${at?.why
      ? html`<p class="warning-line">
        <b>${at.why.detail}</b> ${at.why.fix}
      </p>`
      : !at?.is
      ? html`<p class="reason">Comparing…</p>`
      : html`
        <p class="plainly">
          <b>${mm(at.is.median_mm)} mm</b> apart over the field, median;${" "}
          <b data-testid="apart-worst">${mm(at.is.max_mm)} mm</b> at worst
          ${at.is.worst_place &&
            `, at ${number(at.is.worst_place[0], 0)}, ${number(at.is.worst_place[1], 0)} mm`}
          .
        </p>
        <img
          class="tried"
          alt=${`Map of the difference between versions ${of2[0]} and ${of2[1]}, in mm`}
          src=${address(`/calibrations/${ids[0]}/difference/${ids[1]}.png`)}
        />
      `}
  </section>`;
}
