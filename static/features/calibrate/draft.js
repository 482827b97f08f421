// Saves the document: on the server after every change, and in this browser until the server has it.
import { batch, effect, signal, untracked } from "@preact/signals";
import { Problem, ServerUnreachable, online, request } from "../../core/api.js";
import { EMPTY, change, doc, dragging, fromDraft, isEqual, load } from "../../core/document.js";
import { latestWins } from "../../core/latest_wins.js";
import { notify, notifyError, retract, snapshot } from "../../core/state.js";
import { t } from "../../core/words.js";

const PAUSE_MS = 250; // a nudge held down is one save, not thirty

/**
 * As the server has it. notice: what became of an earlier one.
 * @typedef {{ doc: import("../../core/types").Doc, etag: string, at: string | null, notice: string }} Kept
 */

/** none: no picture; conflict: somebody else saved first, and `theirs` is what they saved. */
export const draft = signal(
  /**
   * @type {{ state: "none" | "saved" | "unsaved" | "away" | "refused" | "conflict", at: number, theirs: Kept | null }}
   */ ({
    state: "none",
    at: 0,
    theirs: null,
  }),
);

/** What the server has, as far as we know. */
let serverDraft = /** @type {Kept | null} */ (null);
/** Who has changed the draft while we looked on; told beside the step, where it covers nothing. */
export const changedBy = signal(/** @type {{ name: string, etag: string } | null} */ (null));
/** Whether what is shown is still just what they made of it. */
export const isTheirs = () =>
  changedBy.value !== null &&
  draft.value.state === "saved" &&
  serverDraft?.etag === changedBy.value.etag;
let timer = 0;
/** Whose save is under way. */
let saving = "";
/** @typedef {{ etag?: string, by?: string }} Heard what was saved last, and by whom */
/** What was heard while we saved: that very save, or another's that came right behind it. */
let pendingChange = /** @type {Heard | null} */ (null);

/** @param {string} id */
const localKey = (id) => `touchline.draft.${id}`;

/** The draft of a picture, as the server has it. @param {string} id */
export const fetchDraft = async (id) => read(await request("GET", `/drafts/${id}`));

/** Work on a draft; clicks that never reached the server come back too. @param {string} id @param {Kept} server */
export function openDraft(id, server) {
  const local = readLocal(id);
  serverDraft = server;
  if (server.notice) notify({ level: "warn", text: server.notice, fix: "" });
  if (!local || isEqual(local.doc, server.doc)) {
    if (local) forgetLocal(id);
    load(server.doc);
    settle("saved", server.at ? Date.parse(server.at) : Date.now());
  } else {
    load(local.doc);
    if (local.etag === server.etag) settle("unsaved");
    else conflict(server);
  }
}

export function closeDraft() {
  serverDraft = null;
  changedBy.value = null;
  draft.value = { state: "none", at: 0, theirs: null };
  load(EMPTY);
}

/** @param {Response} response @returns {Promise<Kept>} */
async function read(response) {
  const body = await response.json();
  const { updated_at: at = null, notice = "" } = body;
  return { doc: fromDraft(body), etag: response.headers.get("ETag") ?? "", at, notice };
}

/** @param {typeof draft.value.state} state @param {number} [at] */
function settle(state, at = draft.value.at) {
  draft.value = { state, at, theirs: null };
}

/** The server has what is shown: this browser need not keep it too. @param {string} id */
function saved(id) {
  forgetLocal(id);
  retract("draft");
  settle("saved", Date.now());
}

/** @param {Kept} theirs */
function conflict(theirs) {
  draft.value = { ...draft.value, state: "conflict", theirs };
}

const save = latestWins(async (/** @type {string} */ id) => {
  const sending = doc.value;
  if (!serverDraft || snapshot.value?.id !== id) return;
  if (draft.value.state === "conflict") return; // the operator is being asked
  if (isEqual(sending, serverDraft.doc)) return saved(id); // taken back while an earlier save was under way
  saving = id; // what is heard meanwhile may be this very save
  try {
    const now = await read(
      await request("PUT", `/drafts/${id}`, {
        json: sending,
        headers: { "If-Match": serverDraft.etag },
      }),
    );
    if (snapshot.value?.id !== id) return;
    serverDraft = { ...now, doc: sending };
    if (isEqual(doc.value, sending)) saved(id);
  } catch (error) {
    if (snapshot.value?.id !== id) return;
    if (error instanceof ServerUnreachable) settle("away");
    else if (error instanceof Problem && error.status === 412) await resolveConflict(id);
    else {
      settle("refused");
      notifyError(error, "draft");
    }
  } finally {
    saving = "";
    if (pendingChange) void fetchChange(pendingChange);
    pendingChange = null;
  }
});

/** @param {string} id */
async function resolveConflict(id) {
  try {
    const theirs = await fetchDraft(id);
    if (snapshot.value?.id !== id) return; // another picture has been opened meanwhile
    if (!isEqual(theirs.doc, doc.value)) return conflict(theirs);
    serverDraft = theirs;
    saved(id);
  } catch {
    if (snapshot.value?.id === id) settle("away");
  }
}

/** Their draft replaces ours; undo brings ours back. */
export function takeTheirs() {
  const { theirs } = draft.value;
  if (!theirs) return;
  serverDraft = theirs;
  if (snapshot.value) saved(snapshot.value.id);
  change(theirs.doc);
}

/** Ours replaces theirs on the server; theirs stands one undo back. */
export function keepMine() {
  const { theirs } = draft.value;
  if (!theirs || !snapshot.value) return;
  const mine = doc.value;
  serverDraft = theirs;
  settle("unsaved");
  batch(() => {
    change(theirs.doc);
    change(mine);
  });
  void save(snapshot.value.id);
}

/** Save every change from now on, and look for others' changes when the operator comes back to this tab. */
export function startSaving() {
  effect(() => {
    const picture = snapshot.value,
      document = doc.value,
      isBack = online.value,
      held = dragging.value;
    if (picture && !held) untracked(() => saveSoon(picture.id, document, isBack));
  });
  addEventListener("focus", () => void fetchOthersChanges());
}

/** @param {string} id @param {import("../../core/types").Doc} document @param {boolean} isOnline */
function saveSoon(id, document, isOnline) {
  if (!serverDraft || draft.value.state === "conflict") return;
  clearTimeout(timer);
  if (isEqual(document, serverDraft.doc) && saving !== id) {
    // while one is under way, what the server had is not what it will have
    if (draft.value.state !== "saved") saved(id);
    return;
  }
  writeLocal(id);
  settle(isOnline ? "unsaved" : "away");
  if (isOnline) timer = setTimeout(() => void save(id), PAUSE_MS);
}

/**
 * Somebody else, or another tab, may have gone on with this picture: take their work if we have none of our own, and
 * say so.
 * @param {string} [etag] of what was just saved, where that is known @param {string} [by] who saved it @returns
 * {Promise<void>} */
export async function fetchOthersChanges(etag, by) {
  if (saving) pendingChange = { etag, by };
  else await fetchChange({ etag, by });
}

// One look after the other: answers in another order would leave an earlier draft standing.
const fetchChange = latestWins(async (/** @type {Heard} */ { etag, by }) => {
  const id = snapshot.value?.id,
    before = serverDraft,
    name = by && !isAddress(by) ? by : "";
  if (!id || !before || draft.value.state !== "saved") return;
  if (etag === bare(before.etag)) {
    // ours, or seen already before it was heard whose it is
    if (name && changedBy.value?.etag === before.etag)
      changedBy.value = { name, etag: before.etag };
    return;
  }
  try {
    const now = await fetchDraft(id);
    const untouched =
      snapshot.value?.id === id &&
      draft.value.state === "saved" &&
      !dragging.value &&
      serverDraft === before &&
      now.etag !== before.etag;
    if (!untouched) return; // a save of ours may have overtaken this answer
    serverDraft = now;
    if (isEqual(now.doc, doc.value)) return;
    change(now.doc);
    changedBy.value = { name: name || t("calibrate.draft.somebody-else"), etag: now.etag };
  } catch {
    /* the next save will tell */
  }
});

/** @param {string} etag */
const bare = (etag) => etag.replace(/^W\//, "").replaceAll('"', "");
/** Who gave no name is known by the machine's address. @param {string} by */
const isAddress = (by) => /^[\d.:a-f]+$|^testclient$/i.test(by);

/** @param {string} id */
function writeLocal(id) {
  try {
    localStorage.setItem(localKey(id), JSON.stringify({ doc: doc.value, etag: serverDraft?.etag }));
  } catch {
    /* a full or forbidden store: the server's copy must do */
  }
}

/** @param {string} id */
function forgetLocal(id) {
  try {
    localStorage.removeItem(localKey(id));
  } catch {
    /* a forbidden store has nothing to forget */
  }
}

/** @param {string} id @returns {{ doc: import("../../core/types").Doc, etag: string } | null} */
function readLocal(id) {
  try {
    return JSON.parse(localStorage.getItem(localKey(id)) ?? "null");
  } catch {
    return null;
  }
}
