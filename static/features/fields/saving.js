// The field that is edited, on the server: saved over what was seen, deleted, put back, and given to a camera.
import { Problem, ServerUnreachable, request, toRefusal } from "../../core/api.js";
import { go, goInstead } from "../../core/route.js";
import { fields, notify, notifyError, retract } from "../../core/state.js";
import { t } from "../../core/words.js";
import { readCameras } from "../calibrate/pictures.js";
import { docOf, markOf, sentOf } from "./document.js";
import {
  KEPT,
  chosen,
  history,
  isShipped,
  opened,
  proposedFrom,
  refusal,
  saving,
  theirs,
} from "./editor.js";

/**
 * @typedef {import("../../core/types").Field} Field
 * @typedef {import("./types").FieldDoc} FieldDoc
 */

/** @param {Response} response */
async function take(response) {
  const field = /** @type {Field} */ (await response.json());
  fields.value = fields.value.some((f) => f.name === field.name)
    ? fields.value.map((f) => (f.name === field.name ? field : f))
    : [...fields.value, field];
  return { field, etag: response.headers.get("ETag") ?? "" };
}

/** Save it over what was seen; a new one only where there is none of that name. */
export async function saveField() {
  const doc = history.doc.value,
    it = opened.value;
  if (!doc || !it || saving.value || isShipped.value) return;
  saving.value = true;
  refusal.value = theirs.value = null;
  const name = it.name || doc.name,
    headers = /** @type {Record<string, string>} */ (
      it.etag ? { "If-Match": it.etag } : { "If-None-Match": "*" }
    );
  try {
    const response = await request("PUT", `/fields/${encodeURIComponent(name)}`, {
        json: sentOf(doc),
        headers,
      }),
      { field, etag } = await take(response);
    localStorage.removeItem(KEPT + it.key);
    if (opened.value !== it) return; // another one is open by now
    opened.value = { key: `=${name}`, name, etag, seen: docOf(field) };
    goInstead("field-editor", { field: name });
    const picture = proposedFrom.value;
    proposedFrom.value = "";
    const back = () => {
      retract(aboutField(name));
      go("calibrate", { picture, step: "field" });
    };
    notify({
      level: "info",
      text: t("field-editor.saved", { title: field.title }),
      fix: t("field-editor.saved-fix"),
      about: aboutField(name),
      ...(picture && { action: { label: t("field-editor.saved.back"), run: back } }),
    });
    await readCameras();
  } catch (error) {
    refuse(error);
  } finally {
    saving.value = false;
  }
}

/** Tell why the server took or computed nothing. @param {unknown} error */
export function refuse(error) {
  if (error instanceof Problem && error.status === 412) {
    theirs.value = {
      field: error.body.current,
      etag: error.body.etag ? `"${error.body.etag}"` : "",
    };
    return;
  }
  if (error instanceof ServerUnreachable) {
    refusal.value = { detail: error.message, fix: t("field-editor.unreachable-fix") };
    return;
  }
  refusal.value = toRefusal(error);
  const doc = history.doc.value,
    mark = doc && markOf(doc, refusal.value.entry ?? "");
  if (mark) chosen.value = [mark];
}

/** Go on with what they saved; undo brings one's own back. */
export function takeTheirs() {
  const it = theirs.value;
  if (!it?.field || !opened.value) return;
  const seen = docOf(it.field);
  opened.value = { ...opened.value, etag: it.etag, seen };
  history.change(seen);
  theirs.value = null;
}

/** Save one's own over theirs, seen now. */
export async function saveOverTheirs() {
  const it = theirs.value;
  if (!it || !opened.value) return;
  opened.value = { ...opened.value, etag: it.etag };
  await saveField();
}

export async function deleteField() {
  const it = opened.value,
    doc = history.doc.value;
  if (!it?.name || !doc) return;
  try {
    await request("DELETE", `/fields/${encodeURIComponent(it.name)}`, {
      headers: { "If-Match": it.etag },
    });
  } catch (error) {
    return refuse(error);
  }
  localStorage.removeItem(KEPT + it.key);
  fields.value = fields.value.filter((f) => f.name !== it.name);
  goInstead("field");
  notify({
    level: "info",
    text: t("field-editor.deleted", { title: doc.title }),
    fix: t("field-editor.deleted-fix"),
    about: aboutField(it.name),
    action: { label: t("common.put-back"), run: () => void putBack(it.seen ?? doc) },
  });
}

/** What notices of a field are about. @param {string} name */
const aboutField = (name) => `field/${name}`;

/** @param {FieldDoc} doc */
async function putBack(doc) {
  try {
    await take(
      await request("PUT", `/fields/${doc.name}`, {
        json: sentOf(doc),
        headers: { "If-None-Match": "*" },
      }),
    );
    retract(aboutField(doc.name));
  } catch (error) {
    notifyError(error);
  }
}

/** Give a camera this field, and all of it where its part is not one of its own. @param {string} camera */
export async function applyToCamera(camera) {
  const field = opened.value?.name,
    doc = history.doc.value;
  if (!field || !doc) return;
  const path = `/cameras/${encodeURIComponent(camera)}`;
  try {
    const seen = await request("GET", path),
      { region } = await seen.json();
    const json = { field, region: region in doc.regions ? region : Object.keys(doc.regions)[0] };
    await request("PATCH", path, { json, headers: { "If-Match": seen.headers.get("ETag") ?? "" } });
    await readCameras();
  } catch (error) {
    notifyError(error);
  }
}
