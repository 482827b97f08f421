// One camera's stream on a canvas that a worker draws, the field's lines over it, and how the camera is.
import { useEffect, useRef } from "preact/hooks";
import { inSentence } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { colour, path } from "../../../canvas/drawing.js";
import { STATES, statuses, streamAddress } from "../camera_status.js";
import { useLiveStream } from "./live_stream.js";
import { StreamState, stateOf } from "./stream_state.js";

const OLD_MS = 1500; // a picture older than this is not called live

/**
 * width: of the stream, px. fps: at most; 0 all.
 * @param {{ id: string, name: string, view?: "raw" | "corrected" | "side", width?: number, fps?: number, lines?:
 * boolean, drawn?: (seq: number) => void }} props drawn: told which frame is shown
 */
export function LiveView({ id, name, view = "raw", width = 480, fps = 0, lines = false, drawn }) {
  const frame = useRef(/** @type {HTMLElement | null} */ (null));
  const { head, problem } = useLiveStream([frame], streamAddress(id, view, width, fps));

  useEffect(() => {
    if (head) drawn?.(head.seq);
  }, [head?.seq]);

  const status = statuses.value[id],
    state = stateOf(id, problem, head);
  const isOld = head !== null && (status?.frame_age_s ?? 0) * 1000 > OLD_MS;
  return html`<div
    class=${`live ${isOld || (state !== "live" && state !== "mismatch") ? "not-live" : ""}`}
    ref=${frame}
    data-testid=${`live-${id}`}
    data-state=${state}
    data-seq=${head?.seq ?? 0}
    data-age=${head ? Math.round(head.age_ms) : ""}
    role="img"
    aria-label=${`${name}, ${inSentence(STATES[state])}`}
    style=${head ? `aspect-ratio:${head.width}/${head.height}` : ""}
  >
    ${
      lines &&
      head?.overlays &&
      html`<svg viewBox=${`-0.5 -0.5 ${head.width} ${head.height}`} aria-hidden="true">
      <g class="field-lines">
        ${head.overlays.field.map((line, i) => html`<path key=${i} class="casing" d=${path(line.points)} />`)}
        ${head.overlays.field.map(
          (line, i) => html`<path
          key=${i}
          d=${path(line.points)}
          style=${line.kind === "border" ? `stroke:${colour(line.feature)}` : ""}
        />`,
        )}
      </g>
    </svg>`
    }
    <${StreamState} id=${id} state=${state} problem=${problem} isOld=${isOld} />
  </div>`;
}
