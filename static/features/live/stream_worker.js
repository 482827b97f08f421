// Decodes a camera's stream on a canvas of its own, away from the page: what arrives is drawn at once, and nothing
// queues.
import { parts } from "../../core/framing.js";
import { leave } from "../../core/leave.js";
import { createWarp } from "../../canvas/warp.js";

/** @type {OffscreenCanvas} */ let canvas;
/** @type {OffscreenCanvas | undefined} of the corrected half, where the two are drawn apart */ let second;
/** @type {Map<OffscreenCanvas, OffscreenCanvasRenderingContext2D | null>} */ const pens =
  new Map();
/** @type {WebSocket | null} */ let socket = null;
/** @type {import("../../core/types").Mesh | null} what makes a corrected picture of the raw one */ let mesh =
  null;
/** @type {ReturnType<typeof createWarp>} */ let warp = null;
/** @type {number[]} */ const times_ms = [];
let address = "",
  wait_ms = 0,
  again = 0,
  decoding = false,
  hasDrawn = false;
/** @type {ArrayBuffer | null} */ let newest = null;
const TIMED_FRAMES = 3, // of which the middle one counts: the first has everything to prepare
  FIRST_WAIT_MS = 250,
  LONGEST_WAIT_MS = 4000;

addEventListener("message", ({ data }) => {
  if (data.canvases) {
    [canvas, second] = data.canvases;
    const drawn = data.corrects ? [canvas] : data.canvases;
    for (const on of drawn) pens.set(on, on.getContext("2d", { alpha: false })); // once: Firefox gives it once only
    if (data.corrects && second) {
      warp = createWarp(second);
      if (!warp) postMessage({ isLost: true });
      second.addEventListener("webglcontextlost", () => postMessage({ isLost: true }));
    }
  }
  if (data.mesh !== undefined) {
    mesh = data.mesh;
    if (mesh) warp?.setMesh(mesh);
  }
  if (data.address !== undefined && data.address !== address) connect(data.address);
  if (data.isOver) end();
});

/** End this worker, once its socket has ended. */
function end() {
  const last = socket;
  connect("");
  if (last?.readyState === WebSocket.CONNECTING) last.addEventListener("close", () => close());
  else close();
}

/** Follow another stream; "" none. @param {string} to */
function connect(to) {
  address = to;
  clearTimeout(again);
  leave(socket);
  socket = null;
  newest = null;
  if (!to) return;
  const here = new WebSocket(to);
  socket = here;
  here.binaryType = "arraybuffer";
  here.addEventListener("message", ({ data }) => {
    if (here !== socket) return;
    if (typeof data === "string") {
      postMessage({ problem: JSON.parse(data) });
      return;
    }
    here.send(""); // the next one may come: this one is taken
    wait_ms = 0;
    newest = data;
    if (!decoding) void show();
  });
  here.addEventListener("close", () => {
    if (here !== socket) return;
    socket = null;
    wait_ms = Math.min(LONGEST_WAIT_MS, wait_ms ? 2 * wait_ms : FIRST_WAIT_MS);
    postMessage({ closed: true });
    again = setTimeout(() => {
      if (address === to) connect(to);
    }, wait_ms);
  });
}

/**
 * One part of a picture on a canvas of its size.
 * @param {OffscreenCanvas} on
 * @param {ImageBitmap} picture
 * @param {import("../../core/types").Half} half
 */
function part(on, picture, { x, y, width, height }) {
  if (on.width !== width || on.height !== height) Object.assign(on, { width, height });
  const pen = /** @type {OffscreenCanvasRenderingContext2D} */ (pens.get(on)); // where there is none, this fails loudly
  pen.drawImage(picture, x, y, width, height, 0, 0, width, height);
}

/** Draw the corrected picture as large as the raw one. @param {ImageBitmap} picture */
function correct(picture) {
  if (!warp || !mesh || !second) return;
  const begun = performance.now(),
    [width, height] = mesh.corrected_size.map((side) => side + 2 * (mesh?.margin_px ?? 0)),
    scale = picture.width / width,
    high = Math.round(height * scale);
  if (second.width !== picture.width || second.height !== high)
    Object.assign(second, { width: picture.width, height: high });
  warp.setPicture(picture, mesh.image_size[0], mesh.image_size[1], false);
  warp.draw({ x: 0, y: 0, scale });
  if (times_ms.length >= TIMED_FRAMES) return;
  warp.finish();
  times_ms.push(performance.now() - begun);
  if (times_ms.length === TIMED_FRAMES)
    postMessage({ frame_ms: times_ms.toSorted((a, b) => a - b)[1] });
}

/** @param {ImageBitmap} picture @param {import("../../core/types").LiveHead} head */
function draw(picture, head) {
  const whole = { x: 0, y: 0, width: picture.width, height: picture.height };
  if (warp) {
    part(canvas, picture, whole);
    correct(picture);
  } else if (second && head.halves) {
    part(canvas, picture, head.halves.raw);
    part(second, picture, head.halves.corrected);
  } else part(canvas, picture, whole);
}

/** Draw the newest message, then the one that came meanwhile. */
async function show() {
  decoding = true;
  while (newest) {
    const { head, payload } = parts(newest);
    newest = null;
    let picture = null;
    try {
      const image = new Blob([/** @type {Uint8Array<ArrayBuffer>} */ (payload)], {
        type: "image/jpeg",
      });
      picture = await createImageBitmap(image);
    } catch (error) {
      if (!hasDrawn) postMessage({ undrawn: String(error) }); // else the next one is a picture again
      continue;
    }
    try {
      draw(picture, head);
      hasDrawn = true;
      postMessage({ head, age_ms: Date.now() - 1000 * head.time });
    } catch (error) {
      postMessage({ undrawn: String(error) });
    }
    picture.close();
  }
  decoding = false;
}
