// The page's own worker, and after each picture that it has drawn, when that was and what time the picture has in it.
import { readTimecode, rows } from "./timecode.js";

/** @type {OffscreenCanvas} */ let canvas;
const post = self.postMessage.bind(self);

addEventListener("message", ({ data }) => {
  if (data.canvases) [canvas] = data.canvases;
});

self.postMessage = (/** @type {any} */ message) => {
  const shown_ms = Date.now();
  post(message.head ? { ...message, shown_ms, taken_ms: taken() } : message);
};

/** The time in the picture that was drawn. */
function taken() {
  const { top, height } = rows(canvas.width);
  const pen = canvas.getContext("2d"); // the worker's own: a canvas has one
  return pen && readTimecode(pen.getImageData(0, top, canvas.width, height));
}

await import("/features/live/stream_worker.js");
postMessage({ isReady: true }); // what was sent before would be heard by nobody
