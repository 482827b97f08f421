// The tour's card beside the work, and the ring around what it speaks of. Nothing is covered and nothing waits for it.
import { useEffect, useRef, useState } from "preact/hooks";
import { ACTIONS, run } from "../../../core/actions.js";
import { html } from "../../../core/html.js";
import { openManual } from "../../../core/manual.js";
import { unfold } from "../../../core/folds.js";
import { t } from "../../../core/words.js";
import { STOPS, firstStop, go, leaveTour, stop, takeTour, tour } from "../tour.js";
import { steps } from "../../shell/steps.js";

const LOOK_MS = 250,
  ROUND_PX = 4,
  NARROW_PX = 720; // up to there the card lies over the lower part of the page

export function Tour() {
  const { on, at } = tour.value,
    it = stop.value,
    place = steps.value.find((s) => s.id === it.step),
    isDone = it.done(),
    waited = useRef(-1); // for which stop
  useEffect(() => {
    if (on && !isDone) waited.current = at;
    else if (on && waited.current === at) go(1); // what it asked for is done
  }, [on, at, isDone]);
  useEffect(() => {
    if (!on) return;
    if (it.step) run(`step-${it.step}`); // as far as it is open; no picture is closed for it
    unfold("lens", it.fold === "lens"); // its comparison costs: not left running behind the other stops
    if (it.fold) unfold(it.fold);
  }, [on, at, place?.open]);
  if (!on) return null;
  const last = at === STOPS.length - 1;
  return html`
    <section class="tour" aria-label=${t("help.tour.title")} data-testid="tour" data-stop=${it.id}>
      <progress
        max=${STOPS.length}
        value=${at + 1}
        aria-label=${t("help.tour.progress", { stop: at + 1, stops: STOPS.length })}
      ></progress>
      <div aria-live="polite">
        <h2>
          ${at + 1}. ${it.title}
        </h2>
        <p>${it.text}</p>
      </div>
      <dl data-testid="tour-numbers">
        ${it.numbers().map(
          ([what, value]) => html`<div key=${what}>
          <dt>${what}</dt>
          <dd>${value}</dd>
        </div>`,
        )}
      </dl>
      ${
        place && !place.open
          ? html`<p class="waits" data-testid="tour-waits">
          ${t("help.tour.not-open", { sentence: place.sentence })}
        </p>`
          : !isDone &&
            place &&
            html`<p class="waits" data-testid="tour-waits">
          ${place.sentence}
        </p>`
      }
      <div class="line">
        <button type="button" data-testid="tour-back" disabled=${at <= firstStop()} onClick=${() => go(-1)}>
          ${t("help.tour.back")}
        </button>
        <button type="button" class="ahead" data-testid="tour-ahead" onClick=${() => go(1)}>
          ${last ? t("help.tour.finish") : t("help.tour.go-on")}
        </button>
        <button type="button" data-testid="tour-more" onClick=${() => void openManual(it.more)}>
          ${t("help.tour.more")}
        </button>
        <button type="button" class="later" data-testid="tour-leave" onClick=${leaveTour}>
          ${t("help.tour.leave")}
        </button>
      </div>
    </section>
    <${Ring} key=${`${at} ${place?.open}`} at=${it.at} />
  `;
}

/** The first of them that is in the page and has a size. @param {string} selector */
const find = (selector) =>
  [...document.querySelectorAll(selector)].find((e) => e.getBoundingClientRect().width > 0);

/**
 * Around the panel that is spoken of, wherever it goes. It is brought into sight, and again when an answer pushed it
 * out, until the operator does something.
 * @param {{ at: string }} props
 */
function Ring({ at }) {
  const [box, setBox] = useState(/** @type {number[] | null} */ (null));
  useEffect(() => {
    const ended = new AbortController(),
      heard = { capture: true, passive: true, signal: ended.signal };
    let alone = true,
      heights = "";
    const look = () => {
      const panel = find(at),
        pane = panel?.closest("aside, .middle, header"),
        now = `${pane?.scrollHeight} ${document.documentElement.scrollHeight}`;
      if (now !== heights && alone)
        panel?.scrollIntoView({ block: innerWidth <= NARROW_PX ? "start" : "nearest" });
      heights = now;
      const r = panel?.getBoundingClientRect(),
        frame = pane?.getBoundingClientRect();
      const [top, bottom] =
        r && frame
          ? [Math.max(r.top, frame.top), Math.min(r.bottom, frame.bottom, innerHeight)]
          : [0, 0];
      const next =
        r && bottom > top
          ? [
              r.left - ROUND_PX,
              top - ROUND_PX,
              r.width + 2 * ROUND_PX,
              bottom - top + 2 * ROUND_PX,
            ].map(Math.round)
          : null;
      setBox((before) => (String(before) === String(next) ? before : next));
    };
    look();
    const timer = setInterval(look, LOOK_MS);
    for (const act of ["pointerdown", "wheel", "keydown"])
      addEventListener(act, () => (alone = false), heard);
    addEventListener("scroll", look, heard);
    return () => {
      clearInterval(timer);
      ended.abort();
    };
  }, [at]);
  if (!box) return null;
  const [left, top, width, height] = box;
  return html`<div
    class="tour-ring"
    data-testid="tour-ring"
    aria-hidden="true"
    style=${`left:${left}px;top:${top}px;width:${width}px;height:${height}px`}
  ></div>`;
}

/** Begins it, or goes on with it. */
export function TourButton() {
  const { on, at } = tour.value;
  if (on) return null;
  return html`<button type="button" data-testid="take-tour" title=${ACTIONS.get("tour")?.label} onClick=${takeTour}>
    ${at ? t("help.tour.resume", { stop: at + 1, stops: STOPS.length }) : t("help.tour.take")}
  </button>`;
}
