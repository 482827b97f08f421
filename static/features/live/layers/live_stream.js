// A camera's stream on canvases that a worker draws, while somebody can see them.
import { useEffect, useRef, useState } from "preact/hooks";
import { choice, frameMs, lose } from "../../../canvas/graphics.js";
import { online } from "../../../core/api.js";
import { t } from "../../../core/words.js";

/** @param {string} error as the browser names it */
const undrawn = (error) => ({
  detail: t("live.undrawn", { error }),
  fix: t("live.undrawn.fix"),
  isUndrawn: true,
});

/** @typedef {import("../../../core/types").LiveHead} LiveHead @typedef {{ current: HTMLElement | null }} Place */

/**
 * The newest frame's head, and what the server says against the stream, or why it is not drawn. One place gets a
 * canvas with the whole picture; two get one each, for the two halves of a picture that stands side by side, or, if it
 * corrects, for a raw one and what a mesh makes of it. address: "" none.
 * @param {Place[]} places @param {string} address @param {boolean} [corrects]
 * @param {import("../../../core/types").Mesh | null} [mesh] */
export function useLiveStream(places, address, corrects = false, mesh = null) {
  const worker = useRef(/** @type {Worker | null} */ (null));
  const [head, setHead] = useState(/** @type {(LiveHead & { age_ms: number }) | null} */ (null));
  const [problem, setProblem] = useState(
    /** @type {{ detail: string, fix: string, isUndrawn?: boolean } | null} */ (null),
  );
  const [seen, setSeen] = useState(!document.hidden);

  useEffect(() => {
    if (!HTMLCanvasElement.prototype.transferControlToOffscreen) {
      setProblem(undrawn("OffscreenCanvas"));
      return undefined;
    }
    // the same canvases and one worker, for as long as this stands and does the same
    const it = new Worker(new URL("../stream_worker.js", import.meta.url), { type: "module" }),
      canvases = places.map(() => document.createElement("canvas"));
    canvases.forEach((canvas, i) => {
      canvas.setAttribute("aria-hidden", "true");
      places[i].current?.prepend(canvas);
    });
    const off = canvases.map((canvas) => canvas.transferControlToOffscreen());
    it.postMessage({ canvases: off, corrects }, off);
    it.addEventListener("message", ({ data }) => {
      if (data.head) {
        setHead({ ...data.head, age_ms: data.age_ms });
        setProblem(null);
      } else if (data.problem) setProblem(data.problem);
      else if (data.undrawn) setProblem(undrawn(data.undrawn));
      if (data.isLost) lose();
      if (data.frame_ms && choice.value === "auto") frameMs.value = data.frame_ms;
    });
    worker.current = it;
    let near = true;
    const look = () => setSeen(near && !document.hidden);
    const watch = new IntersectionObserver((entries) => {
      near = entries.some((entry) => entry.isIntersecting);
      look();
    });
    watch.observe(/** @type {Element} */ (places[0].current));
    document.addEventListener("visibilitychange", look);
    return () => {
      worker.current?.postMessage({ isOver: true });
      for (const canvas of canvases) canvas.remove();
      setHead(null); // nothing is drawn on the next ones yet
      watch.disconnect();
      document.removeEventListener("visibilitychange", look);
    };
  }, [corrects]);
  useEffect(() => {
    if (corrects) worker.current?.postMessage({ mesh });
  }, [corrects, mesh]);
  const wanted = seen && online.value ? address : ""; // Firefox lets one wait a minute after some that failed
  useEffect(() => {
    worker.current?.postMessage({ address: wanted });
  }, [wanted, corrects]); // nothing is sent for nobody's eyes
  return { head, problem };
}
