// Tells that active versions were made before their field was changed, and makes them again.
import { html } from "../../../core/html.js";
import { cameras } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { Working } from "../../../ui/working.js";
import { calibrateAgain, changesInWords, refusal, search } from "../outdated.js";

/** Of one camera, or of all over a field. @param {{ field?: string, camera?: string }} props */
export function Outdated({ field = "", camera = "" }) {
  const found = cameras.value.filter(
      ({ id, active }) =>
        active?.field_changes.length && (camera ? id === camera : active.field === field),
    ),
    of = found[0]?.active?.field ?? "",
    names = found.map((c) => c.name).join(", ");
  if (!of && !search.value && !refusal.value) return null;
  return html`<section class="outdated" aria-label=${t("versions.outdated")} data-testid="outdated">
    ${
      of &&
      html`<div class="warning-line">
      <b>
        ${
          camera
            ? t("versions.outdated.camera")
            : t("versions.outdated.cameras", { count: found.length, cameras: names })
        }
      </b>
      <p>
        ${t("versions.outdated.elsewhere-now", {
          changes: changesInWords([
            ...new Set(found.flatMap((c) => c.active?.field_changes ?? [])),
          ]),
          count: found.length,
        })}
      </p>
      <button
        type="button"
        data-testid="calibrate-again"
        disabled=${search.value !== null}
        onClick=${() => void calibrateAgain(of, camera ? [camera] : null)}
      >
        ${t("versions.outdated.calibrate-again")}
      </button>
    </div>`
    }
    <${Working}
      now=${search.value}
      what=${t("versions.outdated.calibrating")}
      stop="stop-calibrating-again"
      why=${refusal.value}
      name="again"
    />
  </section>`;
}
