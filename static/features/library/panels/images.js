// Images that were worked on: of all cameras and files, or those of one camera.
import { useEffect, useState } from "preact/hooks";
import { call, thumbnail } from "../../../core/api.js";
import { dayAndTime } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { cameras, namedCamera, notifyError, snapshots } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { Watching } from "../../live/panels/camera_page.js";

const PAGE = 48;
const PLACES = [1, 2, 3, 4]; // of images that are not listed yet

export const ImagesPage = () => html`<div class="page" data-testid="images-page">
  <h1>${t("library.images")}</h1>
  <div class="line">
    <${ActionButton} id="open" />
  </div>
  <${Images} />
</div>`;

/** The tab Calibrate of a camera. */
export function CameraImagesPage() {
  const camera = namedCamera.value;
  if (!camera) return null;
  return html`<div class="page" data-testid="camera-images-page">
    <h1>${t("common.calibrate-camera", { camera: camera.name })}</h1>
    <p class="dim">
      ${t("library.calibrate-camera.how")}
    </p>
    <div class="line wrap">
      <${ActionButton} id="take-live" />
      <${ActionButton} id="take-still" />
    </div>
    <${Watching} />
    <${Images} key=${camera.id} camera=${camera.id} />
  </div>`;
}

/** Newest first, of all or of one camera. @param {{ camera?: string }} props */
function Images({ camera = "" }) {
  const [items, setItems] = useState(
      /** @type {import("../../../core/types").Snapshot[] | null} */ (null),
    ),
    [cursor, setCursor] = useState(/** @type {string | null} */ (null)),
    newest = snapshots.value[0]?.id; // one that was taken or opened meanwhile
  /** @param {string | null} from */
  const load = async (from) => {
    const of = `${camera ? `&camera=${encodeURIComponent(camera)}` : ""}${from ? `&cursor=${from}` : ""}`;
    try {
      const found = await call("GET", `/snapshots?purpose=picture&limit=${PAGE}${of}`);
      setItems((before) => (from ? [...(before ?? []), ...found.items] : found.items));
      setCursor(found.next_cursor);
    } catch (error) {
      notifyError(error);
    }
  };
  useEffect(() => void load(null), [newest]);
  return html`<section aria-label=${t("library.earlier-pictures")}>
    <h2>${items?.length === 0 ? t("library.no-image") : t("library.newest-first")}</h2>
    <ul class="recent" aria-busy=${String(items === null)}>
      ${items === null && PLACES.map((at) => html`<li key=${at} class="waits" aria-hidden="true"></li>`)}
      ${items?.map(
        (s) => html`<li key=${s.id}>
        <a href=${addressOf("calibrate", { picture: s.id, step: "points" })} data-testid=${`recent-${s.id}`}>
          <span class="sr">${t("library.go-on-with")} </span>
          <img loading="lazy" alt="" src=${thumbnail(s.id)} />
          <small>
            ${dayAndTime(s.taken_at)}
            <br />
            ${cameras.value.find((c) => c.id === s.camera)?.name || s.name || `${s.width} × ${s.height} px`}
          </small>
        </a>
      </li>`,
      )}
    </ul>
    ${
      cursor &&
      html`<button type="button" data-testid="older-images" onClick=${() => void load(cursor)}>
      ${t("library.show-older")}
    </button>`
    }
  </section>`;
}
