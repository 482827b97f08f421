// All cameras, live, as cards: how each is, and the way to its calibration.
import { useEffect } from "preact/hooks";
import { run } from "../../../core/actions.js";
import { areaName, mm } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { busy, cameras, fields, listed } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { LensForNextPicture } from "../../boards/panels/board.js";
import { LEVEL } from "../../calibrate/panels/levels.js";
import { takePicture } from "../../calibrate/pictures.js";
import { TourButton } from "../../help/panels/tour.js";
import { ActionButton } from "../../../ui/action_button.js";
import { statuses } from "../camera_status.js";
import { LiveView } from "../layers/live_view.js";
import { isWallHeld, troubleOf, wallCameras, wallLines } from "../wall.js";

const CARD_PX = 480,
  PLACES = [1, 2, 3], // of cameras that are not listed yet
  LEAST_MM = 0.05, // less is shown as 0.0
  CARD_FPS = 4; // enough to see what goes on; the camera's own page shows every frame

export function Wall() {
  useEffect(() => () => void (isWallHeld.value = false), []);
  return html`<div class="page wall">
    <h1 class="sr">${t("live.wall.title")}</h1>
    <${LensForNextPicture} />
    ${
      cameras.value.some((camera) => camera.active) &&
      html`<div class="line"><${ActionButton} id="wall-lines" /></div>`
    }
    <ul class="cards cameras" ...${HELD}>
      ${
        !listed.value &&
        cameras.value.length === 0 &&
        PLACES.map(
          (at) => html`<li key=${at} class="card waits" aria-hidden="true">
        <div class="live"></div>
      </li>`,
        )
      }
      ${wallCameras.value.map((camera) => html`<${Tile} key=${camera.id} camera=${camera} />`)}
      <li>
        <a class="card add" data-testid="add-camera" href=${addressOf("new-camera")}>
          <b>${t("live.wall.add")}</b>
          <small>${t("live.wall.add.kinds")}</small>
        </a>
        <button
          type="button"
          class="card add"
          data-testid="drop"
          disabled=${busy.value !== ""}
          onClick=${() => run("open")}
        >
          <b>${busy.value || t("live.wall.open")}</b>
          <small>${t("live.wall.open.how")}</small>
        </button>
        <p><${TourButton} /></p>
      </li>
    </ul>
  </div>`;
}

/** @param {{ currentTarget: Element, relatedTarget: EventTarget | null }} e */
const isLeft = ({ currentTarget, relatedTarget }) =>
  !(relatedTarget instanceof Node && currentTarget.contains(relatedTarget));
const hold = () => {
  isWallHeld.value = true;
};
/** A pointer that leaves may leave the focus in it, and the other way round. @param {any} e */
const release = (e) => {
  if (isLeft(e))
    isWallHeld.value =
      e.type === "focusout"
        ? e.currentTarget.matches(":hover")
        : e.currentTarget.contains(document.activeElement);
};
const HELD = {
  onPointerEnter: hold,
  onPointerLeave: release,
  onFocusIn: hold,
  onFocusOut: release,
};

/** @param {{ camera: import("../../../core/types").Camera }} props */
function Tile({ camera: { id, name, field, region, active } }) {
  const worst = troubleOf(id);
  const title =
    fields.value.find((f) => f.name === field)?.title ?? field ?? t("live.wall.no-field");
  return html`<li class="card" data-testid=${`tile-${id}`} data-level=${worst ? "bad" : active ? "ok" : "none"}>
    <a class="looked" data-testid=${`look-at-${id}`} href=${addressOf("live", { camera: id })}>
      <span class="sr">${t("live.wall.look-at")}${" "}</span>
      <${LiveView} id=${id} name=${name} width=${CARD_PX} fps=${CARD_FPS} lines=${wallLines.value} />
    </a>
    <div class="tile-head">
      <div>
        <b>${name}</b>
        <small>${title}${region ? `, ${areaName(region)}` : ""}</small>
      </div>
      <${Accuracy} id=${id} active=${active} />
    </div>
    <div class="tile-foot">
      <small data-testid=${`drift-${id}`} data-state=${statuses.value[id]?.drift?.state ?? ""}>
        ${
          worst
            ? html`<b>▲ ${worst.text.replace(`${name}: `, "")}</b>`
            : active
              ? t("live.wall.version", { version: active.version, drift: steadiness(id) })
              : t("live.wall.not-calibrated")
        }
      </small>
      ${
        worst?.href &&
        html`<a class="as-button" href=${worst.href} data-testid=${`fix-${id}`}>
        ${t("live.wall.fix")}
      </a>`
      }
      <button
        type="button"
        data-testid=${`camera-${id}`}
        aria-label=${t("common.calibrate-camera", { camera: name })}
        disabled=${busy.value !== ""}
        onClick=${() => void takePicture(id)}
      >
        ${t("live.wall.calibrate")}
      </button>
    </div>
  </li>`;
}

/** @param {string} id */
const steadiness = (id) => statuses.value[id]?.drift?.sentence ?? "";

/** How far off a camera is: as its verdict has it, or now that it moved; each figure in the colour of its own level.
 * @param {{ id: string, active: import("../../../core/types").ActiveVersion | null }} props */
export function Accuracy({ id, active }) {
  const drift = statuses.value[id]?.drift,
    alarm = drift?.alarm ? drift : null;
  if (alarm?.mm && alarm.mm >= LEAST_MM)
    return html`<span class="tile-mm level poor">${rich("live.wall.off", { distance: mm(alarm.mm) })}</span>`;
  if (!active)
    return html`<span class="tile-mm dim" title=${t("live.wall.not-calibrated")}>–</span>`;
  const { mm: value, level = "unknown", levels, sentence = "" } = active.verdict,
    carpet = alarm ? "poor" : (levels?.carpet ?? level);
  return html`<span class=${`tile-mm level ${carpet}`} title=${alarm?.sentence ?? sentence}>
    <b>${value === undefined || value === null || carpet === "unknown" ? "?" : mm(value)}</b> mm
    ${!alarm && levels && html`<${TopsLevel} levels=${levels} />`}
  </span>`;
}

/** Of robot tops, where they have another level.
 * @param {{ levels: import("../../../core/types").Levels }} props */
const TopsLevel = ({ levels: { carpet, robot_tops: tops } }) =>
  tops &&
  tops !== carpet &&
  html`<small class=${`level ${tops}`}>${t("live.wall.tops", { level: LEVEL[tops] })}</small>`;
