// All cameras, live, as cards: how each is, and the way to its calibration.
import { run } from "../../../core/actions.js";
import { mm, words } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { busy, cameras, fields } from "../../../core/state.js";
import { LensForNextPicture } from "../../board/panels/board.js";
import { takePicture } from "../../calibrate/pictures.js";
import { TourButton } from "../../help/panels/tour.js";
import { problems } from "../../shell/problems.js";
import { statuses } from "../camera_status.js";
import { LiveView } from "../layers/live_view.js";

const CARD_PX = 480,
  CARD_FPS = 4; // enough to see what goes on; the camera's own page shows every frame

export function Wall() {
  return html`<div class="page wall">
    <h1 class="sr">Cameras</h1>
    <${LensForNextPicture} />
    <ul class="cards cameras">
      ${cameras.value.map((camera) => html`<${Tile} key=${camera.id} camera=${camera} />`)}
      <li>
        <a class="card add" data-testid="add-camera" href=${addressOf("new-camera")}>
          <b>Add a camera…</b>
          <small>network, USB, industrial, a video, or a simulated one</small>
        </a>
        <button
          type="button"
          class="card add"
          data-testid="drop"
          disabled=${busy.value !== ""}
          onClick=${() => run("open")}
        >
          <b>${busy.value || "Open an image or a calibration file…"}</b>
          <small>or drop it anywhere on this page, or paste it</small>
        </button>
        <p><${TourButton} /></p>
      </li>
    </ul>
  </div>`;
}

/** @param {{ camera: import("../../../core/types").Camera }} props */
function Tile({ camera: { id, name, field, region, active } }) {
  const worst = problems.value.find((it) => it.camera === id && it.level === "bad"),
    alarm = statuses.value[id]?.drift?.alarm ? statuses.value[id].drift : null;
  const title = fields.value.find((f) => f.name === field)?.title ?? field ?? "no field said";
  return html`<li class="card" data-testid=${`tile-${id}`} data-level=${worst ? "bad" : active ? "ok" : "none"}>
    <a class="looked" data-testid=${`look-at-${id}`} href=${addressOf("live", { camera: id })}>
      <span class="sr">Look at </span>
      <${LiveView} id=${id} name=${name} width=${CARD_PX} fps=${CARD_FPS} />
    </a>
    <div class="tile-head">
      <div>
        <b>${name}</b>
        <small>${title}${region ? `, ${words(region).toLowerCase()}` : ""}</small>
      </div>
      <${Accuracy} active=${active} offMm=${alarm?.mm ?? null} />
    </div>
    <div class="tile-foot">
      <small data-testid=${`drift-${id}`} data-state=${statuses.value[id]?.drift?.state ?? ""}>
        ${worst
          ? html`<b>▲ ${worst.text.replace(`${name}: `, "")}</b>`
          : active
            ? `Version ${active.version} is active. ${steadiness(id)}`
            : "Not calibrated"}
      </small>
      ${worst?.href && html`<a class="as-button" href=${worst.href} data-testid=${`fix-${id}`}>Fix…</a>`}
      <button
        type="button"
        data-testid=${`camera-${id}`}
        aria-label=${`Calibrate ${name}`}
        disabled=${busy.value !== ""}
        onClick=${() => void takePicture(id)}
      >
        Calibrate
      </button>
    </div>
  </li>`;
}

/** @param {string} id */
const steadiness = (id) => statuses.value[id]?.drift?.sentence ?? "";

/** How far off it is: as its verdict has it, or now that it moved.
 * @param {{ active: import("../../../core/types").ActiveVersion | null, offMm: number | null }} props */
function Accuracy({ active, offMm }) {
  if (offMm !== null) return html`<span class="tile-mm level poor"><b>${mm(offMm)}</b> mm off</span>`;
  if (!active) return html`<span class="tile-mm dim" title="Not calibrated">–</span>`;
  const { mm: value, level = "unknown" } = active.verdict;
  return html`<span class=${`tile-mm level ${level}`} title=${active.verdict.sentence ?? ""}>
    <b>${value === undefined || level === "unknown" ? "?" : mm(value)}</b> mm
  </span>`;
}
