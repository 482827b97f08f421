// A uPlot in the page: made once for its options, filled anew with every change, in the page's colours, for pointer and
// keyboard.
import { useEffect, useRef } from "preact/hooks";
import { html } from "../core/html.js";
import { t } from "../core/words.js";
import uPlot from "uplot";

/**
 * of: what it is made anew for. at: which place of the data is pointed at, -1 none. describe: what stands there, for
 * screen readers.
 * across, span: the ends of the two scales. draw: what is drawn besides axes; point: somebody points there; take:
 * somebody takes it. isEmpty: nothing stands at that place, and arrow keys pass over it.
 * @param {{ of: string, name: string, label: string, height: number, options: () => Partial<import("uplot").Options>,
 * data: import("uplot").AlignedData, draw: (u: uPlot) => void, across: [number, number], span: [number, number],
 *   at: number, describe: (at: number) => string, point: (at: number) => void, take: (at: number) => void,
 *   isEmpty?: (at: number) => boolean }} props */
export function Plot({
  of,
  name,
  label,
  height,
  options,
  data,
  draw,
  across,
  span,
  at,
  describe,
  point,
  take,
  isEmpty,
}) {
  const place = useRef(/** @type {HTMLElement | null} */ (null)),
    made = useRef(/** @type {uPlot | null} */ (null));
  const now = useRef({ point, take, draw, across, span });
  now.current = { point, take, draw, across, span };
  const count = data[0].length;

  useEffect(() => {
    const element = /** @type {HTMLElement} */ (place.current);
    const it = (made.current = new uPlot(
      {
        width: Math.max(80, element.clientWidth),
        height,
        legend: { show: false },
        series: [{}, { paths: () => null, points: { show: false } }],
        scales: {
          x: { time: false, range: () => now.current.across },
          y: { range: () => now.current.span },
        },
        ...options(),
        cursor: {
          x: true,
          y: false,
          drag: { x: false, y: false, setScale: false },
          points: { show: false },
        },
        hooks: { draw: [(u) => now.current.draw(u)] },
      },
      data,
      element,
    ));
    const leave = () => now.current.point(-1),
      taken = () => {
        if (typeof it.cursor.idx === "number") now.current.take(it.cursor.idx);
      };
    // uPlot's hook setCursor runs for new figures as well, with the place where the cursor was: a key would be undone.
    it.over.addEventListener("mousemove", () => now.current.point(it.cursor.idx ?? -1));
    it.over.addEventListener("pointerleave", leave);
    it.over.addEventListener("click", taken);
    const wide = new ResizeObserver(([entry]) =>
      it.setSize({ width: Math.max(80, entry.contentRect.width), height }),
    );
    wide.observe(element);
    const repaint = () => it.redraw(false, true),
      theme = new MutationObserver(repaint),
      system = matchMedia("(prefers-color-scheme: light)");
    theme.observe(document.documentElement, { attributes: true });
    system.addEventListener("change", repaint);
    return () => {
      wide.disconnect();
      theme.disconnect();
      system.removeEventListener("change", repaint);
      it.destroy();
      made.current = null;
    };
  }, [of, height]);
  const figures = JSON.stringify([data, across, span]); // the same figures are not drawn again, however often they come
  useEffect(() => {
    made.current?.setData(data);
  }, [figures]);
  useEffect(() => {
    // the line goes where something else points
    const it = made.current;
    if (!it) return;
    it.setCursor(
      at < 0 ? { left: -10, top: -10 } : { left: it.valToPos(Number(data[0][at]), "x"), top: 0 },
      false,
    );
    it.redraw(false, false);
  }, [at, figures]);

  /** @param {KeyboardEvent} e */
  const key = (e) => {
    const from = { ArrowLeft: at, ArrowRight: at, Home: -1, End: count }[e.key];
    const step = e.key === "ArrowLeft" || e.key === "End" ? -1 : 1;
    if (from !== undefined) {
      const ahead = data[0].map((_, i) => i).filter((i) => (i - from) * step > 0 && !isEmpty?.(i));
      const next = ahead.at(step > 0 ? 0 : -1);
      if (next !== undefined) point(next);
    } else if ((e.key === "Enter" || e.key === " ") && at >= 0) take(at);
    else return;
    e.preventDefault();
  };
  return html`<div
    class="plot"
    ref=${place}
    data-testid=${name}
    data-at=${at}
    role="slider"
    tabindex="0"
    aria-label=${label}
    aria-valuemin="1"
    aria-valuemax=${Math.max(1, count)}
    aria-valuenow=${Math.max(1, at + 1)}
    aria-valuetext=${at < 0 ? t("ui.plot.nothing-pointed-at") : describe(at)}
    onKeyDown=${key}
  ></div>`;
}
