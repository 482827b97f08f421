// The field that is edited: opened as the address says, and kept in this browser until it is saved.
import { computed, effect, signal, untracked } from "@preact/signals";
import { createViewport } from "../../canvas/viewport.js";
import { request } from "../../core/api.js";
import { createHistory, isEqual } from "../../core/history.js";
import { go, goInstead, route } from "../../core/route.js";
import { fields, listed, notify, notifyError } from "../../core/state.js";
import { t } from "../../core/words.js";
import { blankField, docOf, nameOf, sentOf } from "./document.js";

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

export const KEPT = "touchline.field."; // by key, in this browser
/** A field that was read from a file or an image, on its way into the editor. */
let imported = /** @type {Field | null} */ (null);
/** The image that the open field was proposed from. */
export const proposedFrom = signal("");

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
      label: t("field-editor.action.copy-field.short"),
      missing: "",
      done: true,
      sentence: t("field-editor.next.shipped"),
    };
  const missing = [
    !doc?.title && t("field-editor.next.no-title"),
    doc && !doc.name && t("field-editor.next.no-name"),
    saving.value && t("field-editor.next.saving"),
    !isDirty.value && t("field-editor.next.unchanged"),
  ].find(Boolean);
  return {
    action: "save-field",
    label: t("field-editor.action.save-field.label"),
    missing: missing || "",
    done: !isDirty.value,
    sentence: isDirty.value ? t("field-editor.next.edit") : t("field-editor.next.saved"),
  };
});

/** @param {(doc: FieldDoc) => FieldDoc} to */
export function edit(to) {
  const doc = history.doc.value;
  if (doc && !isShipped.value) history.change(to(doc));
}

/** What the address says: "=name" of one to change, "+name" of a copy, "+" of a new one, "" of none. */
const wanted = computed(() => {
  const { view, field } = route.value;
  if (!listed.value) return null;
  return view === "field-editor" ? `=${field}` : view === "new-field" ? `+${field}` : "";
});

/** Open what the address says, and close it when the page goes elsewhere. */
export function startFieldEditor() {
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

/** @param {string} key as the address says */
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
      begun = localStorage.getItem(KEPT + key); // before the field as it was saved is shown
    if (wanted.value !== key) return;
    imported = null;
    if (!read) proposedFrom.value = "";
    const first = isCopy ? firstOf(field) : docOf(field);
    opened.value = isCopy
      ? { key, name: "", etag: "", seen: null }
      : { key, name, etag: response?.headers.get("ETag") ?? "", seen: docOf(field) };
    history.load(first);
    if (begun) restore(key, begun, read !== null);
    if (read) history.change(unlikeOthers(docOf(read))); // what was begun is one undo away
    viewport.view.value = { ...viewport.view.value, fitted: true };
  } catch (error) {
    if (wanted.value === key) goInstead("field");
    notifyError(error);
  }
}

/** What a new field begins as. @param {Field | null} field what it is a copy of */
const firstOf = (field) => (field ? unlikeOthers(docOf(field), true) : blankField());

/** The field under a title and a name that no other has. @param {FieldDoc} doc @param {boolean} [isCopy] of another */
function unlikeOthers(doc, isCopy = false) {
  const taken = new Set(fields.value.map((f) => f.name));
  if (!isCopy && !taken.has(doc.name)) return doc;
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

/** Show what was begun and not saved; undo leads to what the server has.
 * @param {string} key @param {string} text @param {boolean} isQuiet whether another field is shown at once */
function restore(key, text, isQuiet) {
  if (!opened.value) return;
  try {
    const { doc, etag } = JSON.parse(text);
    history.change(doc);
    opened.value = { ...opened.value, etag }; // whoever saved meanwhile is told of at the next save
    if (!isQuiet)
      notify({
        level: "info",
        text: t("field-editor.restored"),
        fix: t("field-editor.restored-fix"),
        about: `field/${opened.value.name}`,
      });
  } catch {
    localStorage.removeItem(KEPT + key);
  }
}

/** Read a file and open it as a new field. @param {File} file */
export async function openFieldFile(file) {
  const body = new FormData();
  body.append("file", file, file.name);
  try {
    await openAsNew(await (await request("POST", "/fields/read", { body })).json());
  } catch (error) {
    notifyError(error);
  }
}

/** Open a field as a new one. @param {Field} field @param {string} [picture] that it was proposed from */
export async function openAsNew(field, picture = "") {
  imported = field;
  proposedFrom.value = picture;
  if (route.value.view === "new-field" && !route.value.field) await open("+");
  else go("new-field");
}
