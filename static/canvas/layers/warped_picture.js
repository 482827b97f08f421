// The corrected picture, drawn by this browser from the raw one: at any zoom, in the frame in which its mesh changes.
import { useEffect, useLayoutEffect, useRef } from "preact/hooks";
import { html } from "../../core/html.js";
import { t } from "../../core/words.js";
import { choice, frameMs, isLost, isTooLarge, lose, restore } from "../graphics.js";
import { PIXELATED_FROM } from "../viewport.js";
import { createWarp } from "../warp.js";

const TIMED_FRAMES = 3;

/**
 * picture: what it is drawn from, once it is there. x, y, k: where it lies on its pane, as an <img> would. from: share
 * of the pane's width that is hidden.
 * @param {{ picture: HTMLImageElement | null, mesh: import("../../core/types").Mesh, x: number, y: number, k: number,
 * width: number, height: number, from: number }} props width, height: of the pane, px
 */
export function WarpedPicture({ picture, mesh, x, y, k, width, height, from }) {
  const element = useRef(/** @type {HTMLCanvasElement | null} */ (null)),
    warp = useRef(/** @type {ReturnType<typeof createWarp>} */ (null)),
    taken = useRef(/** @type {{ picture?: string, mesh?: unknown, place?: string }} */ ({}));

  useEffect(() => {
    const canvas = /** @type {HTMLCanvasElement} */ (element.current);
    const lost = (/** @type {Event} */ e) => {
      e.preventDefault(); // it is wanted again
      warp.current = null;
      lose();
    };
    canvas.addEventListener("webglcontextlost", lost);
    canvas.addEventListener("webglcontextrestored", restore);
    return () => {
      canvas.removeEventListener("webglcontextlost", lost);
      canvas.removeEventListener("webglcontextrestored", restore);
      warp.current?.end();
      restore();
    };
  }, []);

  useLayoutEffect(() => {
    const canvas = element.current;
    if (!canvas || !picture || isLost.value) return;
    if (!warp.current) {
      warp.current = createWarp(canvas);
      taken.current = {};
    }
    const it = warp.current;
    if (!it) {
      lose(); // though there were some when they were asked for
      return;
    }
    const [rawWidth, rawHeight] = mesh.image_size;
    if (!it.canHold(rawWidth, rawHeight)) {
      isTooLarge.value = true;
      return;
    }
    const ratio = devicePixelRatio,
      before = taken.current,
      isNew = before.picture !== picture.src,
      place = [x, y, k, width, height, from, ratio].join();
    if (!isNew && before.mesh === mesh && before.place === place) return; // the same once more
    if (isNew) it.setPicture(picture, rawWidth, rawHeight, true);
    if (before.mesh !== mesh) it.setMesh(mesh);
    taken.current = { picture: picture.src, mesh, place };
    const wide = Math.max(1, Math.round(width * ratio)),
      high = Math.max(1, Math.round(height * ratio));
    if (canvas.width !== wide || canvas.height !== high)
      Object.assign(canvas, { width: wide, height: high });
    const draw = () =>
      it.draw({
        x: x * ratio,
        y: y * ratio,
        scale: k * ratio,
        from: from * wide,
        isNearest: k >= PIXELATED_FROM,
      });
    draw();
    if (isNew && choice.value === "auto" && frameMs.value === null) frameMs.value = timed(it, draw);
  });

  return html`<canvas
    class="warped"
    ref=${element}
    data-testid="corrected"
    data-drawn=${picture && !isLost.value ? "" : undefined}
    role="img"
    aria-label=${t("canvas.corrected-picture")}
  ></canvas>`;
}

/** How long a frame takes, ms. @param {NonNullable<ReturnType<typeof createWarp>>} warp @param {() => void} draw */
function timed(warp, draw) {
  warp.finish();
  const begun = performance.now();
  for (let i = 0; i < TIMED_FRAMES; i++) draw();
  warp.finish();
  return (performance.now() - begun) / TIMED_FRAMES;
}
