// A rig's page: its cameras at the left, the whole field in one picture in the middle.
import { run } from "../../../core/actions.js";
import { areaName, dayAndTime, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf, route } from "../../../core/route.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Working } from "../../../ui/working.js";
import {
  found,
  others,
  plane,
  refitRig,
  refusal,
  removeRig,
  rig,
  search,
  showMap,
  stitched,
  takeStitched,
} from "../rig.js";
import { RigPicture } from "./rig_picture.js";

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
    <${RigPicture} it=${it} />
  </div>`;
}
