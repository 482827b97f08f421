// The field that is edited: opened as the address says, kept in this browser until saved, saved over what was seen.
import { computed, effect, signal, untracked } from "@preact/signals";
import { Problem, ServerUnreachable, request, toRefusal } from "../../core/api.js";
import { createHistory, isEqual } from "../../core/history.js";
import { go, goInstead, route } from "../../core/route.js";
import { fields, listed, notify, notifyError } from "../../core/state.js";
import { createViewport } from "../../canvas/viewport.js";
import { readCameras } from "../calibrate/pictures.js";
import { blankField, docOf, freeName, markOf, nameOf, sentOf } from "./document.js";

/**
 * @typedef {import("../../core/types").Field} Field
 * @typedef {import("./types").FieldDoc} FieldDoc
 * @typedef {import("./types").Mark} Mark
 */

/** The field and its history; null while none is open. */
export const history = createHistory(/** @type {FieldDoc | null} */ (null));
/**
 * What is open. key: which draft of this browser; name: as the server has it, "" of a new one; etag: of what was seen.
 */
export const opened = signal(
  /** @type {{ key: string, name: string, etag: string, seen: FieldDoc | null } | null} */ (null),
);
export const chosen = signal(/** @type {Mark[]} */ ([]));
/** Where the pointer is, field mm. */
export const pointed = signal(/** @type {import("../../core/types").Point | null} */ (null));
export const sizing = signal(/** @type {"scale" | "borders"} */ ("scale"));
export const saving = signal(false);
export const refusal = signal(/** @type {import("../../core/types").Refusal | null} */ (null));
/** What somebody else has saved meanwhile; field: null where it was deleted. */
export const theirs = signal(/** @type {{ field: Field | null, etag: string } | null} */ (null));
export const viewport = createViewport();

const KEPT = "touchline.field.";
/** A file that was read, on its way into the editor. */
let imported = /** @type {Field | null} */ (null);

/** Whether a field of one's own, or a new one, is on show. */
export const atEditor = computed(() => history.doc.value !== null);
/** What comes with Touchline is looked at, and copied. */
export const isShipped = computed(() => {
  const it = opened.value;
  return Boolean(it?.name) && fields.value.find((f) => f.name === it?.name)?.own === false;
});
export const isDirty = computed(() => {
  const doc = history.doc.value,
    seen = opened.value?.seen;
  return doc !== null && !isShipped.value && !(seen && isEqual(sentOf(doc), seen));
});

/** The next thing to do. */
export const editorNextStep = computed(() => {
  const doc = history.doc.value;
  if (isShipped.value)
    return {
      action: "copy-field",
      label: "Edit a copy",
      missing: "",
      done: true,
      sentence: "This field comes with Touchline and stays as it is. Edit a copy of it.",
    };
  const missing = !doc?.title
    ? "Give the field a title."
    : saving.value
      ? "It is being saved."
      : isDirty.value
        ? ""
        : "Nothing was changed.";
  return {
    action: "save-field",
    label: "Save the field",
    missing,
    done: !isDirty.value,
    sentence: isDirty.value
      ? "Drag lines and their ends, or type their numbers. What meets a line moves with it; hold Alt to move it alone."
      : "The field is saved, and every camera over it uses it.",
  };
});

/** @param {(doc: FieldDoc) => FieldDoc} to */
export function edit(to) {
  const doc = history.doc.value;
  if (doc && !isShipped.value) history.change(to(doc));
}

/** Open what the address says, and close it when the page goes elsewhere. */
export function startFieldEditor() {
  const wanted = computed(() => {
    const { view, field } = route.value;
    if (!listed.value) return null;
    return view === "field-editor" ? `=${field}` : view === "new-field" ? `+${field}` : "";
  });
  effect(() => {
    const key = wanted.value;
    untracked(() => {
      if (key !== null && key !== opened.value?.key) void open(key);
    });
  });
  effect(() => {
    const doc = history.doc.value,
      isHeld = history.dragging.value,
      isNew = isDirty.value;
    const it = untracked(() => opened.value);
    if (!doc || !it || isHeld) return;
    if (isNew) keepLocally(it, doc);
    else localStorage.removeItem(KEPT + it.key);
  });
}

/** @param {string} key "=name" of one to change, "+name" of a copy, "+" of a new one, "" of none */
async function open(key) {
  opened.value = null;
  chosen.value = [];
  refusal.value = theirs.value = null;
  history.load(null);
  if (!key) return;
  const name = key.slice(1);
  try {
    const response = name ? await request("GET", `/fields/${encodeURIComponent(name)}`) : null,
      field = response && (await response.json()),
      isCopy = key.startsWith("+"),
      read = imported,
      begun = read ? null : localStorage.getItem(KEPT + key); // before the field as it was saved is shown
    if (`${route.value.view === "new-field" ? "+" : "="}${route.value.field}` !== key) return;
    imported = null;
    const first = isCopy ? firstOf(field, read) : docOf(field);
    opened.value = isCopy
      ? { key, name: "", etag: "", seen: null }
      : { key, name, etag: response?.headers.get("ETag") ?? "", seen: docOf(field) };
    history.load(first);
    if (begun) restore(key, begun);
    viewport.view.value = { ...viewport.view.value, fitted: true };
  } catch (error) {
    goInstead("fields");
    notifyError(error);
  }
}

/**
 * What a new field begins as.
 * @param {Field | null} field what it is a copy of
 * @param {Field | null} read from a file
 * @returns {FieldDoc}
 */
function firstOf(field, read) {
  if (!field && !read) return blankField();
  const doc = docOf(/** @type {Field} */ (read ?? field)),
    taken = new Set(fields.value.map((f) => f.name));
  if (read && !taken.has(doc.name)) return doc;
  let number = 2;
  const title = () => `${doc.title} (${number})`;
  while (taken.has(nameOf(title()))) number += 1;
  return { ...doc, title: title(), name: nameOf(title()) };
}

/** @param {{ key: string, etag: string }} it @param {FieldDoc} doc */
function keepLocally({ key, etag }, doc) {
  if (!history.past.value.length && !localStorage.getItem(KEPT + key)) return; // opened, and not touched
  try {
    localStorage.setItem(KEPT + key, JSON.stringify({ doc, etag }));
  } catch {
    /* full, or switched off: it is still on the page */
  }
}

/** Show what was begun and not saved; undo leads to what the server has. @param {string} key @param {string} text */
function restore(key, text) {
  if (!opened.value) return;
  try {
    const { doc, etag } = JSON.parse(text);
    history.change(doc);
    opened.value = { ...opened.value, etag }; // whoever saved meanwhile is told of at the next save
    notify({ level: "info", text: "Your unsaved changes of this field are shown.", fix: "Undo leads back." });
  } catch {
    localStorage.removeItem(KEPT + key);
  }
}

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
  const name = it.name || doc.name || nameOf(doc.title),
    headers = /** @type {Record<string, string>} */ (it.etag ? { "If-Match": it.etag } : { "If-None-Match": "*" });
  try {
    const response = await request("PUT", `/fields/${encodeURIComponent(name || "-")}`, {
        json: { ...sentOf(doc), name },
        headers,
      }),
      { field, etag } = await take(response);
    localStorage.removeItem(KEPT + it.key);
    if (opened.value !== it) return; // another one is open by now
    if (!doc.name) history.load({ ...(history.doc.value ?? doc), name });
    opened.value = { key: `=${name}`, name, etag, seen: docOf(field) };
    goInstead("field-editor", { field: name });
    notify({ level: "info", text: `${field.title} is saved.`, fix: "Every camera over it uses it from now on." });
    await readCameras();
  } catch (error) {
    refuse(error);
  } finally {
    saving.value = false;
  }
}

/** @param {unknown} error */
function refuse(error) {
  if (error instanceof Problem && error.status === 412) {
    theirs.value = { field: error.body.current, etag: error.body.etag ? `"${error.body.etag}"` : "" };
    return;
  }
  if (error instanceof ServerUnreachable) {
    refusal.value = { detail: error.message, fix: "Your changes are kept here; save again when it is back." };
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
    await request("DELETE", `/fields/${encodeURIComponent(it.name)}`, { headers: { "If-Match": it.etag } });
  } catch (error) {
    return refuse(error);
  }
  localStorage.removeItem(KEPT + it.key);
  fields.value = fields.value.filter((f) => f.name !== it.name);
  goInstead("fields");
  notify({
    level: "info",
    text: `${doc.title} was deleted.`,
    fix: "Calibrations keep the field that they were made for.",
    action: { label: "Put it back", run: () => void putBack(it.seen ?? doc) },
  });
}

/** @param {FieldDoc} doc */
async function putBack(doc) {
  try {
    await take(await request("PUT", `/fields/${doc.name}`, { json: sentOf(doc), headers: { "If-None-Match": "*" } }));
  } catch (error) {
    notifyError(error);
  }
}

/** Read a file and open it as a new field. @param {File} file */
export async function openFieldFile(file) {
  const body = new FormData();
  body.append("file", file, file.name);
  try {
    imported = await (await request("POST", "/fields/read", { body })).json();
    if (route.value.view === "new-field" && !route.value.field) await open("+");
    else go("new-field");
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

/** Put in a new marking and choose it. @param {"line" | "arc" | "landmark" | "region"} kind */
export function add(kind) {
  const doc = history.doc.value;
  if (!doc) return;
  const name = freeName(doc, kind === "arc" ? "circle" : kind === "region" ? "part" : kind),
    quarter = Math.round(doc.width_mm / 8),
    width_mm = doc.lines[0]?.width_mm ?? 50;
  edit((d) => {
    if (kind === "line")
      return { ...d, lines: [...d.lines, { name, from: [-quarter, quarter], to: [quarter, quarter], width_mm }] };
    if (kind === "arc")
      return {
        ...d,
        arcs: [...d.arcs, { name, centre: [0, 0], radius_mm: quarter, start_deg: 0, end_deg: 360, width_mm }],
      };
    if (kind === "landmark") return { ...d, landmarks: { ...d.landmarks, [name]: [0, quarter] } };
    const half = [d.length_mm / 4, d.width_mm / 4];
    return { ...d, regions: { ...d.regions, [name]: { x: [-half[0], half[0]], y: [-half[1], half[1]], rotate: 0 } } };
  });
  chosen.value = [{ kind, name }];
}
