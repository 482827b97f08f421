// The output picture of a detection stage, live or of the held frame.
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { detectionRequest, framePicture, heldFrame, stagePicture } from "../held_frame.js";
import { streamAddress } from "../../live/camera_status.js";
import { useLiveStream } from "../../live/layers/live_stream.js";

/**
 * @typedef {{ camera: string, stage: string, width: number, fps?: number, drawn?: (seq: number) => void }} Props fps:
 * at most; 0 all. drawn: told which frame is shown
 */

/** @param {Props} props */
export const StagePicture = (props) =>
  detectionRequest.value ? html`<${HeldStage} ...${props} />` : html`<${LiveStage} ...${props} />`;

/** @param {Props} props */
function LiveStage({ camera, stage, width, fps = 0, drawn }) {
  const frame = useRef(/** @type {HTMLElement | null} */ (null));
  const { head } = useLiveStream([frame], streamAddress(camera, `stage-${stage}`, width, fps));
  useEffect(() => {
    if (head) drawn?.(head.seq);
  }, [head?.seq]);
  return html`<div
    class="live"
    ref=${frame}
    role="img"
    aria-label=${t("detection.stages.picture", { stage })}
    data-testid=${`stage-live-${stage}`}
    data-seq=${head?.seq ?? 0}
    style=${head ? `aspect-ratio:${head.width}/${head.height}` : ""}
  ></div>`;
}

/** @param {Props} props */
function HeldStage({ stage }) {
  const [source, setSource] = useState(""),
    body = detectionRequest.value,
    wish = JSON.stringify(body);
  useEffect(() => {
    if (!body) return undefined;
    const stop = new AbortController();
    stagePicture(body, stage, stop.signal).then(
      (made) => {
        if (stop.signal.aborted) URL.revokeObjectURL(made);
        else setSource(made);
      },
      () => {},
    ); // why it cannot be is said once, below the picture
    return () => stop.abort();
  }, [wish, stage]);
  useEffect(
    () => () => {
      if (source) URL.revokeObjectURL(source);
    },
    [source],
  );
  return source
    ? html`<img
      class="held"
      alt=${t("detection.stages.picture", { stage })}
      data-testid=${`stage-held-${stage}`}
      src=${source}
    />`
    : heldFrame.value &&
        html`<img class="held waiting" alt="" src=${framePicture(heldFrame.value)} />`;
}
