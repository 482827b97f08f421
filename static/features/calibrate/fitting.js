// Fits the clicks on the server: each border's curve at pointer rate, the whole fit after every change.
import { computed, effect, signal, untracked } from "@preact/signals";
import { ServerUnreachable, call, online, toRefusal } from "../../core/api.js";
import { BORDERS, doc, dragging, isEqual, pointsOf } from "../../core/document.js";
import { latestWins, pause } from "../../core/latest_wins.js";
import { automaticModel, compare, editing, field, model, snapshot } from "../../core/state.js";
import { isOurs } from "../../canvas/graphics.js";
import { MARGIN_PX } from "../../canvas/viewport.js";
import { onField } from "./editing.js";
import { curveThrough } from "./live_curve.js";

/**
 * @typedef {import("../../core/types").Border} Border
 * @typedef {import("../../core/types").Curve} Curve
 * @typedef {import("../../core/types").Refusal} Refusal
 */

const AXIS = { left: "x_of_y", right: "x_of_y", top: "y_of_x", bottom: "y_of_x" };
const PAUSE_MS = 50; // between two questions of a kind while a point is dragged
const PATIENCE_MS = 500; // with an earlier fit: then the newer one takes its place in the server's queue
const SERIES = String(crypto.getRandomValues(new Uint32Array(1))[0]); // this window's fits
const FEWEST = 3; // on a border, for a degree that is chosen by the server
const AUTOMATIC = "auto"; // what the server calls the model that it chooses

/** Each border's curve, or why there is none. */
export const curves = signal(/** @type {Partial<Record<Border, Curve | Refusal>>} */ ({}));
/** The whole fit of the present document, or why there is none; null until there is something to say. */
export const preview = signal(/** @type {import("../../core/types").Preview | null} */ (null));
export const refusal = signal(/** @type {Refusal | null} */ (null));
/** True while the preview belongs to an earlier document. */
export const stale = signal(false);

/** Whether the picture is to be seen corrected as well, by the clicks as they are now. */
export const wantsMesh = computed(
  () => editing.value && compare.value.editing !== "raw" && isOurs.value,
);

/** Whether the present answer is to be asked for once more, with what is to be seen now. */
const lacksMesh = computed(() => wantsMesh.value && preview.value !== null && !preview.value.mesh);

/** @param {Curve | Refusal | undefined} curve @returns {curve is Curve} */
export const isCurve = (curve) => curve !== undefined && "curve" in curve;

/** What is fitted: clicks on a line that somebody took off the field are kept, and left out.
 * @param {import("../../core/types").Doc} d */
export const fittedPoints = (d) =>
  field.value ? onField(d.observations, field.value) : d.observations;

/**
 * The sides of a fit that the server wants.
 * @param {import("../../core/types").Doc} d
 * @param {string} [automatic] what to fit where the model is left to the server
 */
export const fitBody = (d, automatic = AUTOMATIC) => ({
  snapshot: snapshot.value?.id,
  field: d.field,
  region: d.region,
  model: d.model ?? automatic,
  options: d.options,
  observations: fittedPoints(d),
  ...(d.rotate === null ? {} : { rotate: d.rotate }),
});

/** The present fit, as the server takes it back. */
export const givenFit = () =>
  preview.value && !refusal.value
    ? {
        model: { name: preview.value.model.name, parameters: preview.value.model.parameters },
        field: doc.value.field,
        region: doc.value.region,
        ...(doc.value.rotate === null ? {} : { rotate: doc.value.rotate }),
      }
    : null;

/** @param {Border} border */
function borderAsker(border) {
  return latestWins(
    async (/** @type {{ picture: string, body: Record<string, any> }} */ { picture, body }) => {
      let answer;
      try {
        answer = { ...(await call("POST", "/fit/border", body)), points: body.points };
      } catch (error) {
        if (error instanceof ServerUnreachable) return forgetAsked(border);
        answer = toRefusal(error);
      }
      // An answer about another picture, or about a point that has gone, would be drawn in the wrong place.
      const current = pointsOf(doc.value, border);
      if (snapshot.value?.id !== picture || current.length !== body.points.length) return;
      show(
        border,
        isCurve(answer) && dragging.value
          ? (curveThrough(answer, current, run(border)) ?? answer)
          : answer,
      );
      if (dragging.value) await pause(PAUSE_MS); // it is drawn without the server: the fit may go first
    },
  );
}

/** @param {Border} border @returns {0 | 1} */
const run = (border) => (AXIS[border] === "x_of_y" ? 1 : 0);

/** @param {Border} border @param {Curve | Refusal | undefined} what */
function show(border, what) {
  curves.value = { ...curves.value, [border]: what };
}

/**
 * Draw a dragged border's curve at once; the server's answer follows.
 * @param {Border} border
 * @param {import("../../core/types").Point[]} points
 */
function bend(border, points) {
  const shown = curves.value[border];
  const bent =
    isCurve(shown) && shown.points.length === points.length
      ? curveThrough(shown, points, run(border))
      : null;
  if (bent) show(border, bent);
}

const asked = new Map(BORDERS.map((border) => [border, { ask: borderAsker(border), last: "" }]));

/** The question was lost: ask it again when the server is back. @param {Border} border */
function forgetAsked(border) {
  const it = asked.get(border);
  if (it) it.last = "";
}

/**
 * Ask for the curve of every border that has changed.
 * @param {import("../../core/types").Snapshot | null} picture
 * @param {import("../../core/types").Doc} document
 */
function askCurves(picture, document) {
  const degree = document.options.degree ?? "auto";
  for (const border of BORDERS) {
    const points = pointsOf(document, border),
      it = asked.get(border);
    if (!it) continue;
    const body = picture && {
      points,
      axis: AXIS[border],
      degree,
      image_size: [picture.width, picture.height],
    };
    const question = JSON.stringify([picture?.id, body]);
    if (question === it.last) continue;
    it.last = question;
    if (dragging.value) bend(border, points);
    if (picture && points.length >= (degree === "auto" ? FEWEST : Number(degree) + 1))
      void it.ask({ picture: picture.id, body: /** @type {any} */ (body) });
    else if (curves.value[border]) show(border, undefined);
  }
}

/** Whether there is anything to fit. @param {import("../../core/types").Doc} d */
const hasClicks = (d) => Boolean(d.field && d.region && d.observations.length);

let fitsAsked = 0,
  fitShown = 0; // their numbers: an answer that a newer one has overtaken is not shown any more

const askPreview = latestWins(
  async (
    /** @type {{ picture: string, asking: import("../../core/types").Doc, held: boolean }} */ {
      picture,
      asking,
      held,
    },
  ) => {
    if (snapshot.value?.id !== picture) return; // it waited for an earlier answer while another picture was opened
    const number = ++fitsAsked;
    let answer = null,
      why = null;
    const quick = held ? `&quick=${knowsItsError()}` : "",
      mesh = wantsMesh.value ? `&mesh_margin_px=${MARGIN_PX}` : "";
    try {
      const body = held ? quickBody(asking) : fitBody(asking);
      const attempt = await call("POST", `/fit/attempt?series=${SERIES}${quick}${mesh}`, body);
      answer = attempt.preview;
      why = attempt.refusal && { ...attempt.refusal, detail: attempt.refusal.what };
    } catch (error) {
      if (error instanceof ServerUnreachable) return;
      why = toRefusal(error);
      if (why.reason === "superseded") return;
    }
    if (number < fitShown) return;
    if (why && held && dragging.value) return; // what stands is drawn on; the release will tell
    if (snapshot.value?.id !== picture || !hasClicks(doc.value)) return;
    fitShown = number;
    preview.value = answer;
    if (answer) automaticModel.value = answer.model.name;
    refusal.value = why;
    stale.value = !(held && dragging.value) && !isEqual(asking, doc.value);
    if (held && dragging.value) await pause(PAUSE_MS);
  },
  PATIENCE_MS,
);

/**
 * Whether the fit tells an error without holding points out: what holding them out would cost is saved while a point is
 * dragged.
 */
const knowsItsError = () => Boolean(preview.value?.report.sigma_mm);

/**
 * While a point is dragged the lens keeps the terms it has: choosing them is most of a lens fit's time.
 * @param {import("../../core/types").Doc} asking
 */
function quickBody(asking) {
  const body = fitBody(asking, preview.value?.model.name),
    terms = preview.value?.report.terms?.chosen,
    canChoose = model.value?.options.some((o) => o.name === "terms");
  return canChoose && terms && (asking.options.terms ?? "auto") === "auto"
    ? { ...body, options: { ...body.options, terms } }
    : body;
}

/** Keep curves and preview up to date from now on. */
export function startFitting() {
  effect(() => {
    const picture = snapshot.value,
      document = doc.value;
    if (online.value) untracked(() => askCurves(picture, document)); // and again when a silent server is back
  });
  let lastPreview = "";
  effect(() => {
    const picture = snapshot.value,
      document = doc.value,
      held = dragging.value,
      isOnline = online.value,
      over = field.value, // a draft follows its field
      isIncomplete = lacksMesh.value;
    untracked(() => {
      const question = JSON.stringify([picture?.id, document, over]);
      if (!isOnline) lastPreview = "";
      stale.value = question !== lastPreview;
      if (!isOnline || !(stale.value || isIncomplete)) return;
      if (held) {
        // seen at once, if not quite up to date; asked anew when it is released
        stale.value = false;
        lastPreview = "";
        if (picture && hasClicks(document) && preview.value && !refusal.value)
          void askPreview({ picture: picture.id, asking: document, held });
        return;
      }
      lastPreview = question;
      if (picture && hasClicks(document))
        return void askPreview({ picture: picture.id, asking: document, held });
      preview.value = null;
      refusal.value = null;
      stale.value = false;
    });
  });
}
