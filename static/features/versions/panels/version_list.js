// Every version of a camera: the active one, the former one, the difference of two.
import { useEffect } from "preact/hooks";
import { address } from "../../../core/api.js";
import { areaName, dayAndTime, mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf, route } from "../../../core/route.js";
import { cameras, modelTitle } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { Typed } from "../../../ui/typed.js";
import { reportAddress } from "../../report/address.js";
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
import { TurnMenu } from "./turning.js";
import { VersionChange } from "./version_change.js";

/** @typedef {import("../types").VersionRecord} Kept */

export function VersionListPage() {
  const camera = listedCamera.value,
    it = versionList.value?.camera === camera ? versionList.value : null;
  useEffect(() => {
    void loadVersionList(camera);
  }, [camera]);
  return html`<div class="page wide" data-testid="versions-page">
    <h1>${t("versions.saved-versions")}</h1>
    ${
      route.value.place === "library" &&
      html`<nav class="tabs desks" aria-label=${t("versions.list.of-which-camera")}>
      ${[...cameras.value, { id: "", name: t("versions.list.from-files") }].map(
        ({ id, name }) => html`<a
        key=${id}
        class="tab"
        href=${addressOf("versions", { camera: id })}
        data-testid=${`shelf-${id || "files"}`}
        aria-current=${id === camera ? "page" : undefined}
      >
        ${name}
      </a>`,
      )}
    </nav>`
    }
    ${
      !it
        ? html`<p class="dim">${t("common.asking")}</p>`
        : html`
        ${camera && html`<${Outdated} camera=${camera} />`}
        <${RollBack} />
        ${
          it.items.length
            ? html`<ul class="shelf" data-testid="shelf">
            ${it.items.map(
              (v, i) => html`<${Version}
                key=${v.id}
                it=${v}
                before=${camera ? (it.items[i + 1] ?? null) : null}
              />`,
            )}
          </ul>`
            : html`<p class="dim">
            ${rich("versions.list.nothing-saved", {
              link: html`<a href=${addressOf("wall")}>${t("versions.list.take-picture")}</a>`,
            })}
          </p>`
        }
        ${
          it.next &&
          html`<button type="button" onClick=${() => void loadMore()}>
          ${t("versions.list.show-older")}
        </button>`
        }
      `
    }
  </div>`;
}

/** The way back is always in sight. */
function RollBack() {
  const before = formerVersion.value,
    now = activeVersion.value;
  if (!before || !now) return null;
  return html`<div class="plainly line" data-testid="roll-back">
    <span class="grow">
      ${
        before.by
          ? rich("versions.roll-back.active-by", {
              version: now.version,
              former: before.version,
              person: before.by,
            })
          : rich("versions.roll-back.active", { version: now.version, former: before.version })
      }
    </span>
    <button
      type="button"
      data-testid="do-roll-back"
      onClick=${() =>
        void activateCalibration({
          id: before.calibration,
          version: before.version,
          camera: now.camera,
        })}
    >
      ${t("versions.roll-back.go-back", { version: before.version ?? "" })}
    </button>
  </div>`;
}

/** before: of the same camera, if there is one. @param {{ it: Kept, before: Kept | null }} props */
function Version({ it, before }) {
  const { id, version, active, camera, snapshot, report, field_changes: changes = [] } = it,
    model = modelTitle(it.model.name);
  const isChosen = comparedPair.value.includes(id);
  return html`<li
    class=${`card${active ? " now" : ""}`}
    data-testid="shelf-version"
    data-version=${version}
    data-active=${String(active)}
  >
    <div class="line">
      <b>${t("versions.version", { version })}</b>
      ${active && html`<b class="level good">${t("common.active")}</b>`}
      <span class=${`level ${report.verdict.levels?.carpet ?? report.verdict.level}`}>${mm(report.verdict.mm)} mm</span>
      ${
        changes.length > 0 &&
        html`<b
        class="level poor"
        data-testid="field-changed"
        title=${t("versions.list.elsewhere-now", { changes: changesInWords(changes) })}
      >
        ${t("common.field-changed")}
      </b>`
      }
      <small class="grow">
        ${model}, ${areaName(it.region)}; ${dayAndTime(it.created_at)}
        ${it.made_by && t("versions.list.made-by", { person: it.made_by })}
      </small>
    </div>
    <${VersionChange} it=${it} before=${before} />
    <${Typed}
      type="text"
      class="note"
      data-testid="shelf-note"
      maxlength="2000"
      aria-label=${t("versions.note-for", { version })}
      placeholder=${t("versions.list.add-note")}
      value=${it.note}
      take=${(/** @type {string} */ text) => annotate(it, text)}
    />
    <div class="line wrap">
      ${
        camera &&
        !active &&
        html`<button type="button" data-testid="shelf-activate" onClick=${() => void activateCalibration(it)}>
          ${t("versions.activate")}
        </button>`
      }
      ${
        snapshot &&
        html`<a
        href=${addressOf("calibrate", { picture: snapshot, step: "verify" })}
        data-testid="shelf-open"
      >
        ${t("versions.list.open-picture")}
      </a>`
      }
      <a href=${reportAddress(id)} target="_blank" rel="noopener">
        ${t("versions.list.open-report")}
      </a>
      <a href=${addressOf("scene", { scene: id })} data-testid="shelf-scene">
        ${t("common.scene")}
      </a>
      <a href=${address(`/calibrations/${id}/export/json`)} download=${`touchline-v${version}.json`}>
        ${t("versions.list.download-json")}
      </a>
      <label class="line">
        <input type="checkbox" data-testid="shelf-compare" checked=${isChosen} onChange=${() => choose(id)} />${" "}
        ${t("versions.list.compare")}
      </label>
      <button
        type="button"
        data-testid="shelf-delete"
        disabled=${active}
        title=${active ? t("versions.list.delete-active") : t("versions.list.delete-version", { version })}
        onClick=${() => void deleteVersion(it)}
      >
        ${t("versions.list.delete")}
      </button>
    </div>
    <${TurnMenu} it=${it} />
    <${ExportMenu} it=${it} />
  </li>`;
}

/** On the right: two compared, and what was active when. */
export function VersionListReport() {
  const it = versionList.value;
  return html`
    <${Two} />
    <section aria-label=${t("versions.history")}>
      <h2>${t("versions.history.title")}</h2>
      ${
        it?.history.length
          ? html`<ol class="plain history" data-testid="history">
          ${it.history.map(
            (h) => html`<li key=${h.at + h.calibration}>
            <b>${h.version === null ? t("versions.history.deleted") : t("versions.version", { version: h.version })}</b>
            <small>
              ${dayAndTime(h.at)}
              ${h.by && t("versions.history.activated-by", { person: h.by })}
            </small>
          </li>`,
          )}
        </ol>`
          : html`<p class="reason">${t("versions.history.nothing")}</p>`
      }
    </section>
  `;
}

function Two() {
  const ids = comparedPair.value,
    at = pairDifference.value,
    of2 = ids.map((id) => versionList.value?.items.find((v) => v.id === id)?.version ?? "?");
  if (ids.length < 2)
    return html`<section>
      <h2>${t("versions.two.title")}</h2>
      <p class="reason">${t("versions.two.choose")}</p>
    </section>`;
  return html`<section aria-label=${t("versions.two")} data-testid="apart">
    <h2>
      ${t("versions.two.versions", { first: of2[0], second: of2[1] })}
    </h2>
    ${
      at?.why
        ? html`<p class="warning-line">
        <b>${at.why.detail}</b> ${at.why.fix}
      </p>`
        : !at?.is
          ? html`<p class="reason">${t("versions.two.comparing")}</p>`
          : html`
        <p class="plainly">
          ${rich("versions.two.apart", {
            median: mm(at.is.median_mm),
            worst: html`<b data-testid="apart-worst">${mm(at.is.max_mm)} mm</b>`,
            place: at.is.worst_place
              ? t("versions.two.apart-place", {
                  x: number(at.is.worst_place[0], 0),
                  y: number(at.is.worst_place[1], 0),
                })
              : "",
          })}
        </p>
        <img
          class="tried"
          alt=${t("versions.two.map", { first: of2[0], second: of2[1] })}
          src=${address(`/calibrations/${ids[0]}/difference/${ids[1]}.png`)}
        />
      `
    }
  </section>`;
}
