// The lenses that a file may mean, each under a picture of what it makes of the camera's image.
import { useEffect, useState } from "preact/hooks";
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
  const name = cameras.value.find((c) => c.id === camera)?.name ?? camera,
    { width, height } = lenses[0].lens.image_size;
  return html`<p>
      ${shown && (shown.isDrawn ? t("versions.import.lens-drawings") : t("versions.import.lens-images", { camera: name }))}
    </p>
    <div class="lens-choices" aria-busy=${String(!shown)}>
      ${choices.map(
        (choice, i) => html`<figure key=${choice.label}>
        <div style=${`aspect-ratio: ${width} / ${height}`}>
          ${
            shown &&
            html`<img
            data-testid="lens-picture"
            data-drawn=${String(shown.isDrawn)}
            src=${shown.urls[i]}
            alt=${t(shown.isDrawn ? "versions.import.drawn-by" : "versions.import.corrected-by", { lens: choice.label })}
          />`
          }
        </div>
        <button type="button" data-testid="import-choice" onClick=${() => choose(choice)}>${choice.label}</button>
      </figure>`,
      )}
    </div>`;
}
