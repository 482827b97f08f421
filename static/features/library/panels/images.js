// Images that were worked on: of all cameras and files, or those of one camera.
import { useEffect } from "preact/hooks";
import { address } from "../../../core/api.js";
import { dayAndTime, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { cameras, namedCamera, snapshots } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Watching } from "../../live/panels/camera_page.js";
import { followCameras } from "../../live/camera_status.js";

export const ImagesPage = () => html`<div class="page" data-testid="images-page">
  <h1>Images</h1>
  <div class="line">
    <${ActionButton} id="open" />
  </div>
  <${Images} items=${snapshots.value} />
</div>`;

/** The tab Calibrate of a camera. */
export function CameraImagesPage() {
  const camera = namedCamera.value;
  useEffect(() => (camera ? followCameras([camera.id]) : undefined), [camera?.id]);
  if (!camera) return null;
  return html`<div class="page" data-testid="camera-images-page">
    <h1>Calibrate ${camera.name}</h1>
    <p class="dim">
      Take an image and calibrate from it, or go on with one that was begun. Empty the field of people, or take the
      image without what moves.
    </p>
    <div class="line wrap">
      <${ActionButton} id="take-live" />
      <${ActionButton} id="take-still" />
    </div>
    <${Watching} />
    <${Images} items=${snapshots.value.filter((s) => s.camera === camera.id)} />
  </div>`;
}

/** @param {{ items: import("../../../core/types").Snapshot[] }} props */
const Images = ({ items }) => html`<section aria-label="Earlier pictures">
  <h2>${items.length ? `${plural(items.length, "image")}, newest first` : "No image yet"}</h2>
  <ul class="recent">
    ${items.map((s) => html`<li key=${s.id}>
      <a href=${addressOf("calibrate", { picture: s.id, step: "points" })} data-testid=${`recent-${s.id}`}>
        <span class="sr">Go on with the image of </span>
        <img loading="lazy" alt="" src=${address(`/snapshots/${s.id}/image.jpg`)} />
        <small>
          ${dayAndTime(s.taken_at)}
          <br />
          ${cameras.value.find((c) => c.id === s.camera)?.name ?? `${s.width} × ${s.height} px`}
        </small>
      </a>
    </li>`)}
  </ul>
</section>`;
