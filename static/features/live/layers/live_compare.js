// A camera's raw and corrected picture on one stage, of the very same frame: wiped, blinking or side by side, under one
// view.
import { useEffect, useRef } from "preact/hooks";
import { inSentence, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import {
  OnCorrected,
  OnRaw,
  Wipe,
  correctedClip,
  correctedPlace,
  rawClip,
} from "../../../canvas/layers/compare.js";
import { correctsHere } from "../../../canvas/graphics.js";
import { listen } from "../../../canvas/tools/pointer.js";
import { rich } from "../../../ui/rich.js";
import {
  comparedVersion,
  correctedPlacement,
  fieldUnderPointer,
  mode,
  paneUnder,
  pointedAt,
  visiblePicture,
} from "../../compare/comparison.js";
import { mesh } from "../../compare/correction.js";
import { STATES, VIEW_PX, streamAddress } from "../camera_status.js";
import { liveMargin, livePointer, liveView } from "../live_compare.js";
import { useLiveStream } from "./live_stream.js";
import { StreamState, stateOf } from "./stream_state.js";

const WIDTH = 1600,
  WIDE = 2880,
  ENLARGED = 1.6; // px of both halves together; the wider one where more is seen than that gives
const NOTHING = { down: () => {}, move: () => {}, up: () => {}, cancel: () => {} };

/** @param {{ id: string, name: string, children: any }} props children: the words beside what is drawn */
export function LiveCompare({ id, name, children }) {
  const stage = useRef(/** @type {HTMLElement | null} */ (null)),
    raw = useRef(/** @type {HTMLElement | null} */ (null)),
    corrected = useRef(/** @type {HTMLElement | null} */ (null));
  const it = comparedVersion.value,
    { k, tx, ty } = liveView.view.value,
    [width, height] = it?.image_size ?? [4, 3];
  const isNear = k * devicePixelRatio * width > (ENLARGED * WIDTH) / 2;
  const here = correctsHere.value ? mesh.value : null; // this browser makes the corrected half of the raw picture
  const { head, problem } = useLiveStream(
    [raw, corrected],
    correctsHere.value
      ? streamAddress(id, "raw", isNear ? WIDE / 2 : VIEW_PX)
      : streamAddress(id, "side", isNear ? WIDE : WIDTH),
    correctsHere.value,
    here,
  );
  const around = here ? here.margin_px : (head?.halves?.margin_px ?? 0),
    isSide = mode.value === "side";

  useEffect(() => {
    if (around) liveMargin.value = around;
  }, [around]);
  useEffect(() => {
    const element = /** @type {HTMLElement} */ (stage.current);
    const watch = new ResizeObserver(([entry]) => {
      liveView.size.value = { width: entry.contentRect.width, height: entry.contentRect.height };
      if (liveView.view.value.fitted) liveView.fit({ width, height });
    });
    watch.observe(element);
    const off = listen(element, {
      pick: NOTHING,
      isPicking: () => false,
      ...liveView,
      point: (at) => {
        livePointer.value = at;
      },
    });
    return () => {
      watch.disconnect();
      off();
      livePointer.value = null;
    };
  }, [width, height]);

  /** Which of two pictures the pointer is over. @param {PointerEvent} e */
  const inPane = (e) => {
    const { left, top } = /** @type {Element} */ (e.currentTarget).getBoundingClientRect();
    paneUnder.value = liveView.paneAt(e.clientX - left, e.clientY - top);
  };
  const state = stateOf(id, problem, head),
    at = correctedPlace.value;
  const size = it?.corrected_size.map((side) => side + 2 * liveMargin.value) ?? [4, 3];
  const isLive = state === "live" || state === "mismatch";
  return html`<div class="live-compare">
    <div
      class=${`live compared${isLive ? "" : " not-live"}`}
      ref=${stage}
      tabindex="0"
      data-testid=${`live-${id}`}
      data-state=${state}
      data-seq=${head?.seq ?? 0}
      data-compared=${it && correctedPlacement.value ? visiblePicture.value : ""}
      role="group"
      aria-label=${t("live.compare.pictures", { camera: name, state: inSentence(STATES[state]) })}
      style=${`aspect-ratio:${(isSide ? 2 : 1) * width}/${height}`}
      onPointerMoveCapture=${inPane}
      onPointerDownCapture=${inPane}
    >
      <div class="half" style=${rawClip.value}>
        <div
          class="sheet"
          ref=${raw}
          data-testid="live-raw"
          style=${`width:${width}px;height:${height}px;transform:translate(${tx}px,${ty}px) scale(${k})`}
        ></div>
        <${OnRaw} />
      </div>
      <div class="half" style=${it && at ? correctedClip.value : "visibility:hidden"}>
        <div
          class="sheet"
          ref=${corrected}
          data-testid="live-corrected"
          style=${
            at
              ? `width:${size[0]}px;height:${size[1]}px;transform:translate(${at.x}px,${at.y}px) scale(${at.k})`
              : ""
          }
        ></div>
        <${OnCorrected} />
      </div>
      <${Wipe} />
      <${StreamState} id=${id} state=${state} problem=${problem} />
    </div>
    <${LiveReadOut} />
    <div class="live-legends">${children}</div>
  </div>`;
}

/** What is under the pointer. */
function LiveReadOut() {
  const on = pointedAt.value,
    spot = fieldUnderPointer.value;
  const pixel = on && `${number(on.point[0])}, ${number(on.point[1])}`,
    place = spot
      ? `${number(spot[0], 0)}, ${number(spot[1], 0)} mm`
      : t("live.compare.out-of-reach");
  return html`<p class="reason" data-testid="live-read-out">
    ${
      on
        ? rich(
            on.from === "corrected" ? "live.compare.pixel-corrected" : "live.compare.pixel-raw",
            { pixel, place },
          )
        : t("live.compare.how-to-zoom")
    }
  </p>`;
}
