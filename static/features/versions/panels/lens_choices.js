// The lenses that a file may mean, each under a picture of what it makes of the camera's image.
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "../../../core/html.js";
import { cameras, notifyError } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { importOptions } from "../imports.js";
import { lensPictures } from "../lens_choices.js";

/** @typedef {import("../imports.js").Choice} Choice */

/** @param {{ choices: Choice[], choose: (choice: Choice) => void }} props */
export function LensChoices({ choices, choose }) {
  const { camera } = importOptions.value,
    [shown, setShown] = useState(/** @type {{ urls: string[], isDrawn: boolean } | null} */ (null)),
    buttons = useRef(/** @type {HTMLElement | null} */ (null)),
    lenses = choices.flatMap((choice) => choice.lens ?? []);
  useEffect(() => {
    let isWanted = true;
    const loading = lensPictures(lenses, camera);
    loading.then((found) => isWanted && setShown(found)).catch(notifyError);
    return () => {
      isWanted = false;
      setShown(null);
      void loading.then(({ urls }) => urls.forEach(URL.revokeObjectURL)).catch(() => {});
    };
  }, [choices, camera]);
  useEffect(() => buttons.current?.scrollIntoView({ block: "nearest" }), [shown]);
  const name = cameras.value.find((c) => c.id === camera)?.name ?? camera,
    { width, height } = lenses[0].lens.image_size;
  const why = camera
    ? t("versions.import.no-camera-image", { camera: name })
    : t("versions.import.select-camera");
  const drawings = `${t("versions.import.lens-drawings")} ${why}`;
  return html`<p>
      ${shown && (shown.isDrawn ? drawings : t("versions.import.lens-images", { camera: name }))}
    </p>
    <div class="lens-choices" ref=${buttons} aria-busy=${String(!shown)}>
      ${choices.map(
        (choice, i) => html`<figure key=${choice.label}>
        <div style=${`aspect-ratio: ${width} / ${height}`}>
          ${
            shown &&
            html`<img
            data-testid="lens-picture"
            data-drawn=${String(shown.isDrawn)}
            src=${shown.urls[i]}
            alt=${alt(choice.label, shown.isDrawn)}
          />`
          }
        </div>
        <button type="button" data-testid="import-choice" onClick=${() => choose(choice)}>${choice.label}</button>
      </figure>`,
      )}
    </div>`;
}

/** @param {string} lens @param {boolean} isDrawn */
const alt = (lens, isDrawn) =>
  isDrawn ? t("versions.import.drawn-by", { lens }) : t("versions.import.corrected-by", { lens });
