// A rig's page: its cameras at the left, the whole field in one picture in the middle.
import { run } from "../../../core/actions.js";
import { areaName, dayAndTime, mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf, route } from "../../../core/route.js";
import { t } from "../../../core/words.js";
import { MapScale, shadeOf } from "../../../ui/map_scale.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Working } from "../../../ui/working.js";
import { path } from "../../../canvas/drawing.js";
import {
  found,
  others,
  pictureAddress,
  plane,
  refitRig,
  refusal,
  removeRig,
  rig,
  search,
  showMap,
  stitched,
  takeStitched,
  worst,
} from "../rig.js";
import { TrackMarks } from "./tracks.js";

/** @typedef {import("../types").Pair} Pair @typedef {import("../../../core/types").Point} Point */

export function RigForm() {
  const it = rig.value,
    common = it?.rectangles,
    isBusy = search.value !== null,
    outdated = it?.checked?.outdated[0];
  if (!it)
    return html`<section>
      <h2>${t("rig.none")}</h2>
      <p class="reason">${t("rig.none.what")}</p>
    </section>`;
  return html`
    <section aria-label=${t("rig.members")}>
      <h2>${it.title || it.name}</h2>
      <ul class="plain rig-cameras">
        ${it.cameras.map(
          (c) => html`<li key=${c.camera} data-testid=${`member-${c.camera}`}>
          <b>${c.title}</b>${" "}
          <small>
            ${c.region ? areaName(c.region) : t("rig.member.own-region")}
            ${c.version ? t("rig.member.version", { version: c.version }) : ""}
          </small>
          ${c.troubles.map(
            ({
              reason,
              text,
              fix,
            }) => html`<p key=${reason} class="warning-line" data-reason=${reason}>
            <b>${text}</b> ${fix}
          </p>`,
          )}
        </li>`,
        )}
      </ul>
      ${
        outdated &&
        html`<p class="warning-line" data-testid="rig-outdated" data-reason=${outdated.reason}>
        <b>${outdated.text}</b> ${outdated.fix}
      </p>`
      }
    </section>
    <section aria-label=${t("rig.rectangles")}>
      <h2>${t("rig.rectangles.title")}</h2>
      ${
        common
          ? html`<p class="reason" data-testid="rectangles">
          ${t(
            it.rectangles_from === "rig" ? "rig.rectangles.of-rig" : "rig.rectangles.of-cameras",
            {
              columns: common.n_rectangles_x,
              rows: common.n_rectangles_y,
              width: number(common.w_max_rectangle_px, 1),
              height: number(common.h_max_rectangle_px, 1),
            },
          )}
        </p>`
          : html`<p class="reason">${t("rig.rectangles.none")}</p>`
      }
      ${
        others.value.length > 0 &&
        html`
        <button type="button" data-testid="refit-rig" disabled=${isBusy} onClick=${() => void refitRig()}>
          ${t("rig.refit")}
        </button>
        <p class="reason">${t("rig.refit.what")}</p>
      `
      }
    </section>
    <section aria-label=${t("rig.this")}>
      <button type="button" onClick=${() => void removeRig(it)}>${t("rig.remove")}</button>
      <p class="reason">${t("rig.saved", { when: dayAndTime(it.updated_at) })}</p>
    </section>
  `;
}

export function RigPage() {
  const it = rig.value,
    isBusy = search.value !== null,
    now = stitched.value;
  if (!it)
    return html`<div class="page">
      <p class="dim">${t("rig.no-such", { rig: route.value.rig })}</p>
    </div>`;
  return html`<div class="page rig" data-testid="rig-page">
    <h1>${it.title || it.name}</h1>
    <div class="line">
      <button type="button" data-testid="check-rig" disabled=${isBusy} onClick=${() => run("check-rig")}>
        ${t("rig.check")}
      </button>
      <${ActionButton} id="follow-play" />
      <button type="button" data-testid="take-stitched" onClick=${() => void takeStitched()}>
        ${t("rig.take-anew")}
      </button>
      <a href=${addressOf("scene", { scene: `rig/${it.name}` })} data-testid="rig-scene">${t("common.scene")}</a>
      ${
        found.value &&
        html`
        <div class="switch" role="group" aria-label=${t("rig.shown")}>
          <button
            type="button"
            data-testid="show-map"
            aria-pressed=${showMap.value}
            onClick=${() => {
              showMap.value = !showMap.value;
            }}
          >
            ${t("rig.shown.map")}
          </button>
        </div>
        <div class="switch" role="group" aria-label=${t("rig.plane")}>
          ${
            /** @type {const} */ (["carpet", "hat"]).map(
              (at) => html`<button
              key=${at}
              type="button"
              data-testid=${`plane-${at}`}
              aria-pressed=${plane.value === at}
              onClick=${() => {
                plane.value = at;
              }}
            >
              ${t(`rig.plane.${at}`)}
            </button>`,
            )
          }
        </div>
      `
      }
    </div>
    <${Working} now=${search.value} what=${t("rig.checking")} stop="stop-rig" why=${refusal.value} name="rig" />
    ${
      now?.refusal &&
      html`<div class="warning-line" role="alert" data-testid="no-stitched">
      <b>${now.refusal.detail}</b> ${now.refusal.fix}
    </div>`
    }
    ${now?.info && now.of === it.name && html`<${Picture} name=${it.name} at=${now.at} info=${now.info} />`}
  </div>`;
}

/**
 * The whole field, with its lines, the map and the worst place as vectors.
 * @param {{ name: string, at: number, info: import("../types").Stitched }} props
 */
function Picture({ name, at, info }) {
  const {
      width,
      height,
      px_per_mm: k,
      corner: [[x0, y0]],
    } = info,
    pairs = found.value?.pairs ?? [],
    top = worst.value?.at.max_mm ?? 0;
  /** @param {Point} p @returns {Point} */
  const px = ([x, y]) => [(x - x0) * k, (y0 - y) * k];
  const mark = showMap.value && worst.value ? px(worst.value.at.where) : null;
  return html`<figure class="stitched">
    <div class="over">
      <img
        data-testid="stitched"
        src=${pictureAddress(name, at)}
        width=${width}
        height=${height}
        alt=${t("rig.picture.alt")}
      />
      <svg
        viewBox=${`-0.5 -0.5 ${width} ${height}`}
        data-testid="rig-overlay"
        role="img"
        aria-label=${worst.value ? t("rig.overlay.worst", { worst: mm(top) }) : t("rig.overlay.lines")}
      >
        ${
          showMap.value &&
          pairs.map((p) => html`<${Cells} key=${`${p.a} ${p.b}`} pair=${p} px=${px} k=${k} />`)
        }
        ${info.overlay.map((l) => html`<path key=${l.feature} class="paint" d=${path(l.points)} />`)}
        <${TrackMarks} px=${px} k=${k} />
        ${
          mark &&
          html`<g class="where" transform=${`translate(${mark[0]} ${mark[1]})`}>
          <circle r="12" />
          <path d="M-7-7L7 7M-7 7L7-7" />
        </g>`
        }
      </svg>
      ${
        mark &&
        html`<span
        data-testid="rig-worst"
        class=${`worst-said${mark[0] > width * 0.8 ? " to-left" : ""}`}
        style=${`left:${(100 * mark[0]) / width}%;top:${(100 * mark[1]) / height}%`}
      >
        ${t("rig.picture.worst", { worst: mm(top) })}
      </span>`
      }
    </div>
    <figcaption>
      ${showMap.value && worst.value && html`<${MapScale} />`}
      <p class="reason" data-testid="unseen">${info.unseen.words}</p>
    </figcaption>
  </figure>`;
}

/** One pair's map. @param {{ pair: Pair, px: (p: Point) => Point, k: number }} props */
function Cells({ pair, px, k }) {
  const at = pair.agreement?.[plane.value];
  if (!at) return null;
  const { x, y, mm: cells } = at.map,
    w = (x[1] - x[0]) * k,
    h = (y[1] - y[0]) * k;
  return html`<g class="cells" data-testid="cells">
    ${cells.flatMap((row, j) =>
      row.map((v, i) => {
        if (v === null) return null;
        const [cx, cy] = px([x[i], y[j]]);
        return html`<rect key=${`${i},${j}`} x=${cx - w / 2} y=${cy - h / 2} width=${w} height=${h} fill=${shadeOf(v)}>
          <title>${mm(v)} mm</title>
        </rect>`;
      }),
    )}
  </g>`;
}
