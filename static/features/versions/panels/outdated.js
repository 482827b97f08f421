// Tells that active versions were made before their field was changed, and makes them again.
import { plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { cameras } from "../../../core/state.js";
import { Working } from "../../../ui/working.js";
import { calibrateAgain, changesInWords, refusal, search } from "../outdated.js";

/** Of one camera, or of all over a field. @param {{ field?: string, camera?: string }} props */
export function Outdated({ field = "", camera = "" }) {
  const found = cameras.value.filter(
      ({ id, active }) => active?.field_changes.length && (camera ? id === camera : active.field === field),
    ),
    of = found[0]?.active?.field ?? "",
    names = found.map((c) => c.name).join(", ");
  if (!of && !search.value && !refusal.value) return null;
  return html`<section class="outdated" aria-label="Calibrated before the field was changed" data-testid="outdated">
    ${of && html`<div class="warning-line">
      <b>
        ${camera
          ? "The active version was made before the field was changed."
          : `${plural(found.length, "camera")} calibrated before the field was changed: ${names}.`}
      </b>
      <p>
        Elsewhere now: ${changesInWords([...new Set(found.flatMap((c) => c.active?.field_changes ?? []))])}.${" "}
        Until then ${found.length === 1 ? "it is" : "they are"} not published.
      </p>
      <button
        type="button"
        data-testid="calibrate-again"
        disabled=${search.value !== null}
        onClick=${() => void calibrateAgain(of, camera ? [camera] : null)}
      >
        Calibrate again from the kept points
      </button>
    </div>`}
    <${Working}
      now=${search.value}
      what="Calibrating again"
      stop="stop-calibrating-again"
      why=${refusal.value}
      name="again"
    />
  </section>`;
}
