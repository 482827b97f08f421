// All cameras, live, as cards: how each is, and the way to a picture of it.
import { useEffect } from "preact/hooks";
import { html } from "../../../core/html.js";
import { go } from "../../../core/route.js";
import { busy, cameras, fields } from "../../../core/state.js";
import { Title } from "../../../ui/title.js";
import { takePicture } from "../../calibrate/pictures.js";
import { DriftWords } from "../../drift/panels/drift.js";
import { followCameras } from "../camera_status.js";
import { LiveView } from "../layers/live_view.js";

const CARD_PX = 480,
  CARD_FPS = 4; // enough to see what goes on; the desk shows every frame

export function Cameras() {
  const ids = cameras.value.map((c) => c.id).join(" ");
  useEffect(() => (ids ? followCameras(ids.split(" ")) : undefined), [ids]);
  return html`<section aria-label="Cameras">
    <${Title} of="cameras">${cameras.value.length ? "Take a picture with a camera" : "Cameras"}<//>
    <ul class="cards cameras">
      ${cameras.value.map(({ id, name, field }) => html`<li key=${id} class="card">
        <button type="button" class="looked" data-testid=${`look-at-${id}`} onClick=${() => go("live", { camera: id })}>
          <span class="sr">Look at </span>
          <${LiveView} id=${id} name=${name} width=${CARD_PX} fps=${CARD_FPS} />
        </button>
        <b>${name}</b>
        <small>${fields.value.find((f) => f.name === field)?.title ?? field ?? "no field said"}</small>
        <${DriftWords} id=${id} />
        <button
          type="button"
          data-testid=${`camera-${id}`}
          aria-label=${`Take a picture with ${name}`}
          disabled=${busy.value !== ""}
          onClick=${() => void takePicture(id)}
        >
          Take a picture
        </button>
      </li>`)}
      <li>
        <button type="button" class="card add" data-testid="add-camera" onClick=${() => go("new-camera")}>
          <b>Add a camera…</b>
          <small>network, USB, industrial, a video, or a simulated one</small>
        </button>
      </li>
    </ul>
  </section>`;
}
