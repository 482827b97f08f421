// The mesh that the corrected picture is drawn with: of the saved version, or of the clicks as they are now.
import { computed, effect, signal, untracked } from "@preact/signals";
import { request } from "../../core/api.js";
import { BORDERS, doc, dragging, pointsOf } from "../../core/document.js";
import { parts } from "../../core/framing.js";
import { comparing, editing, notifyError } from "../../core/state.js";
import { isOurs } from "../../canvas/graphics.js";
import { MARGIN_PX } from "../../canvas/viewport.js";
import { curves, isCurve, preview, refusal, stale } from "../calibrate/fitting.js";
import { bentMesh } from "../calibrate/live_mesh.js";
import { atLive } from "../live/camera_page.js";
import { liveRecord } from "../live/live_compare.js";
import { version } from "../versions/versions.js";

/** @typedef {import("../../core/types").Mesh} Mesh @typedef {import("../../core/types").MeshHeader} MeshHeader */

const PAPERS_MODEL = "polynomial"; // whose correction the page can bend by itself

const fetched = signal(/** @type {{ id: string, mesh: Mesh } | null} */ (null));

/** @param {MeshHeader} header @param {ArrayBuffer} bytes little-endian, as are all machines with a browser */
const withNodes = (header, bytes) => ({ ...header, nodes: new Float32Array(bytes) });

/** @param {string} text base64 */
const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;

const previewed = computed(() => {
  const mesh = refusal.value ? null : preview.value?.mesh;
  return mesh ? withNodes(mesh, bytesOf(mesh.raw_px)) : null;
});

/** Which points of each border are strays, as text: most answers leave them as they were. */
const strays = computed(() =>
  JSON.stringify(
    BORDERS.map((border) => {
      const curve = curves.value[border];
      return isCurve(curve) && curve.points.length === pointsOf(doc.value, border).length
        ? curve.outliers
        : [];
    }),
  ),
);

/** The same, bent to where the points are that the server has not answered for yet. */
const bent = computed(() => {
  const mesh = previewed.value,
    model = preview.value?.model;
  if (!mesh || model?.name !== PAPERS_MODEL || !(dragging.value || stale.value)) return null;
  /** @type {number[][]} */
  const leftOut = JSON.parse(strays.value);
  const points = Object.fromEntries(
    BORDERS.map((border, b) => [
      border,
      pointsOf(doc.value, border).filter((_, i) => !leftOut[b].includes(i)),
    ]),
  );
  return bentMesh(mesh, /** @type {any} */ (model.parameters), /** @type {any} */ (points));
});

/** The saved version whose correction is in sight, of a still or live picture. */
const wanted = computed(() =>
  comparing.value ? version.value?.id : atLive.value ? liveRecord.value?.id : null,
);

/** What is drawn now, if this browser corrects. */
export const mesh = computed(() => {
  if (!isOurs.value) return null;
  if (editing.value) return bent.value ?? previewed.value;
  return wanted.value && fetched.value?.id === wanted.value ? fetched.value.mesh : null;
});

/** Fetch the mesh of the version that is compared, from now on. */
export function startCorrection() {
  effect(() => {
    const id = wanted.value && isOurs.value ? wanted.value : null;
    untracked(() => {
      if (id && fetched.value?.id !== id) void fetchMesh(id).catch(notifyError);
    });
  });
}

/** @param {string} id */
async function fetchMesh(id) {
  const answer = await request("GET", `/calibrations/${id}/mesh?margin_px=${MARGIN_PX}`),
    { head, payload } = parts(await answer.arrayBuffer());
  fetched.value = { id, mesh: withNodes(head, payload.slice().buffer) };
}
