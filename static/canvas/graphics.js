// Who corrects pictures: this browser's graphics processor, or the server where there is none that keeps up.
import { computed, signal } from "@preact/signals";
import { number } from "../core/format.js";
import { t } from "../core/words.js";

/** @typedef {"auto" | "browser" | "server"} Choice */

const KEPT = "touchline.correction";
const RETRY_MS = 5000, // to ask for graphics again that were taken away
  MAX_LOSSES = 3, // one after the other: then nothing is asked for any more
  QUIET_MS = 60_000, // after which a loss is the first again
  SLOW_MS = 20; // a frame that takes longer is not drawn while a point is dragged
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i; // as renderers that are none name themselves

/** @type {[Choice, string][]} */
export const CHOICES = [
  ["auto", t("canvas.graphics.choice.auto")],
  ["browser", t("canvas.graphics.choice.browser")],
  ["server", t("canvas.graphics.choice.server")],
];
const toChoice = (/** @type {string | null} */ kept) =>
  CHOICES.find(([id]) => id === kept)?.[0] ?? "auto";

/** What the operator wants. */
export const choice = signal(toChoice(localStorage.getItem(KEPT)));
/** @param {Choice} to */
export function chooseCorrection(to) {
  choice.value = to;
  localStorage.setItem(KEPT, to);
}

/** What WebKit calls every renderer: on another machine than Apple's that may be software. */
const isMasked = (/** @type {string} */ name) =>
  name === "Apple GPU" && !/mac|iphone|ipad/i.test(navigator.platform);

/** The name of what draws, "" where the browser has no WebGL 2. Asked once, when it is first wanted. */
const renderer = computed(() => {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl) return "";
  const name = gl.getParameter(gl.RENDERER),
    known = gl.getExtension("WEBGL_debug_renderer_info");
  const full = known ? gl.getParameter(known.UNMASKED_RENDERER_WEBGL) : name;
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return String(full || name || t("canvas.graphics.unnamed"));
});

/** How long its first frames took, ms; null before they were drawn. */
export const frameMs = signal(/** @type {number | null} */ (null));
/** Whether the browser has taken the graphics away, as after the machine slept, until it gives them back. */
export const isLost = signal(false);
/** Whether they were taken away so often that they are no longer asked for. */
const hasFailed = signal(false);
let again = 0,
  losses = 0,
  lost_ms = -Infinity;
/** They are gone: try again after a while, if nobody says before that they are back. */
export function lose() {
  const now_ms = performance.now();
  losses = now_ms - lost_ms < QUIET_MS ? losses + 1 : 1;
  lost_ms = now_ms;
  isLost.value = true;
  hasFailed.value = losses > MAX_LOSSES;
  clearTimeout(again);
  if (!hasFailed.value) again = setTimeout(restore, RETRY_MS);
}
export function restore() {
  clearTimeout(again);
  isLost.value = false;
}
/** Whether a picture was too large for it. */
export const isTooLarge = signal(false);

/** That the server does it, and why; "" where it does not. */
const why = computed(() => {
  if (choice.value === "server") return t("canvas.graphics.server.chosen");
  if (!renderer.value) return t("canvas.graphics.server.no-webgl");
  if (isTooLarge.value) return t("canvas.graphics.server.too-large");
  if (hasFailed.value) return t("canvas.graphics.server.failed");
  if (choice.value === "browser") return "";
  if (SOFTWARE.test(renderer.value))
    return t("canvas.graphics.server.software", { renderer: renderer.value });
  if (frameMs.value !== null && frameMs.value > SLOW_MS)
    return t("canvas.graphics.server.slow", {
      frame: number(frameMs.value, 0),
      renderer: renderer.value,
    });
  return "";
});
/** Whether this browser is to do it. */
export const isOurs = computed(() => why.value === "");
/** Whether it can do so now. */
export const correctsHere = computed(() => isOurs.value && !isLost.value);

/** Whether it is known to draw quickly: by its name, or measured where that tells nothing. */
export const drawsFast = () =>
  renderer.value !== "" &&
  !SOFTWARE.test(renderer.value) &&
  (!isMasked(renderer.value) || (frameMs.value ?? Infinity) <= SLOW_MS);

/** Both in words, for System. */
export const correctionWords = computed(() =>
  !isOurs.value
    ? why.value
    : isLost.value
      ? t("canvas.graphics.server.lost")
      : t("canvas.graphics.browser", { renderer: renderer.value }),
);
