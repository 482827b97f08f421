// Two cameras with a common view: the pictures, the calibrations, and the matches clicked in both.
// They are kept in this browser, a document for each pair of pictures: a draft on the server is of one picture.
import { batch, computed, effect, signal, untracked } from "@preact/signals";
import { call, request } from "../../core/api.js";
import { createHistory, isEqual } from "../../core/history.js";
import { requestOrder } from "../../core/latest_wins.js";
import { go, goInstead, route } from "../../core/route.js";
import { busy, cameras, notices, notify, notifyError, snapshots } from "../../core/state.js";
import { t } from "../../core/words.js";
import { createViewport } from "../../canvas/viewport.js";

const LAST = "touchline.pair"; // the two pictures that were compared last
export const ENOUGH = 12; // matches: seven numbers are fitted, the others bear them out

/**
 * @typedef {import("./types").Side} Side
 * @typedef {import("./types").Match} Match
 * @typedef {import("./types").PairDoc} PairDoc
 */

/** @type {Side[]} */
export const SIDES = ["a", "b"];
/** @type {PairDoc} */
const EMPTY = { matches: [], calibrations: { a: null, b: null } };

export const pair = createHistory(EMPTY);
export const pictures = signal(
  /** @type {Record<Side, import("../../core/types").Snapshot | null>} */ ({ a: null, b: null }),
);
/** Versions that each picture could have been taken with, newest first. */
export const suitedCalibrations = signal(
  /** @type {Record<Side, import("../../core/types").Calibration[]>} */ ({ a: [], b: [] }),
);
export const views = { a: createViewport(), b: createViewport() };
/** Where the keys work. */
export const side = signal(/** @type {Side} */ ("a"));
export const chosen = signal(/** @type {{ side: Side, index: number } | null} */ (null));
export const pointed = signal(
  /** @type {{ side: Side, x: number, y: number, touch: boolean, down: boolean } | null} */ (null),
);
/** How high the next points lie, mm; null: not known. */
export const nextHeight = signal(/** @type {number | null} */ (0));

export const both = computed(() => pictures.value.a !== null && pictures.value.b !== null);
export const complete = computed(() => pair.doc.value.matches.filter((m) => m.a && m.b).length);

/** @param {Side} s @returns {Side} */
export const other = (s) => (s === "a" ? "b" : "a");
/** @param {Side} s */
export const sideName = (s) => t(`pair.side.${s}`);

/**
 * What is proposed while nobody has chosen: the one that is active for the picture's camera, else one made from the
 * picture.
 * @param {Side} s
 */
function proposed(s) {
  const picture = pictures.value[s],
    all = suitedCalibrations.value[s];
  return (
    (picture?.camera ? all.find((c) => c.active && c.camera === picture.camera) : null) ??
    all.find((c) => c.snapshot === picture?.id) ??
    null
  );
}

/** Each picture's calibration: the operator's choice, else the proposal. "" is the choice of none. */
export const calibrations = computed(() => {
  const of = (/** @type {Side} */ s) => {
    const id = pair.doc.value.calibrations[s];
    return id === null ? proposed(s) : (suitedCalibrations.value[s].find((c) => c.id === id) ?? null);
  };
  return { a: of("a"), b: of("b") };
});

/** How high a robot's hat is over the field of the pair, mm; null while no calibration says which field it is. */
export const hatMm = computed(() => {
  const it = calibrations.value.a ?? calibrations.value.b;
  return it ? (it.field_definition.hat_height_mm ?? 150) : null; // kept before fields said so: the largest league
});

/** What the next click makes: the second point of a match that waits for it, else a new match. */
export const wantedHeight = computed(() => {
  const { matches } = pair.doc.value,
    waits = (/** @type {Match | undefined} */ m) => m && !(m.a && m.b);
  const index =
    chosen.value && waits(matches[chosen.value.index]) ? chosen.value.index : matches.findIndex(waits);
  return index < 0
    ? { index: matches.length, side: /** @type {Side} */ ("a"), isNew: true }
    : { index, side: /** @type {Side} */ (matches[index].a ? "b" : "a"), isNew: false };
});

/** Whether the page is at two cameras. */
export const atPair = computed(() => route.value.view === "pair");

/** @param {string} a @param {string} b */
const key = (a, b) => `${LAST}.${a}.${b}`;

const wishes = requestOrder();

/** Show the two pictures of the address; where it names none, those that were compared last. */
async function follow() {
  const { left, right } = route.value,
    isAsked = left !== "";
  if (isAsked && pictures.value.a?.id === left && pictures.value.b?.id === right) return;
  const isNewest = wishes.begin(),
    ids = isAsked ? [left, right] : (read(LAST) ?? []);
  const found = await Promise.all(
    ids.map((/** @type {string | null} */ id) =>
      id ? call("GET", `/snapshots/${encodeURIComponent(id)}`).catch(() => gone(isAsked)) : null,
    ),
  );
  // else others were chosen meanwhile
  if (atPair.value && isNewest()) show({ a: found[0] ?? null, b: found[1] ?? null }, goInstead);
}

/** @param {boolean} wasAsked */
function gone(wasAsked) {
  if (wasAsked)
    notify({ level: "warn", text: t("pair.notice.gone"), fix: t("pair.notice.gone.fix") });
  return null;
}

/**
 * Show two pictures, with what was clicked in them, and say so in the address.
 * @param {Record<Side, import("../../core/types").Snapshot | null>} next
 * @param {typeof go} write
 */
function show(next, write) {
  wishes.begin();
  const kept = next.a && next.b ? read(key(next.a.id, next.b.id)) : null;
  remember(LAST, [next.a?.id ?? null, next.b?.id ?? null]); // first: an address without them is followed by this
  batch(() => {
    pictures.value = next;
    chosen.value = null;
    pair.load({ ...EMPTY, ...kept });
    if (atPair.value) write("pair", { left: next.a?.id, right: next.b?.id });
  });
  for (const s of SIDES) {
    views[s].fit(next[s]);
    void listSuited(s);
  }
}

/** @param {Side} s @param {import("../../core/types").Snapshot | null} picture */
export const setPicture = (s, picture) => show({ ...pictures.value, [s]: picture }, go);

/** @param {Side} s @param {string} camera */
export const takeFor = (s, camera) =>
  bring(s, t("pair.taking"), () => call("POST", "/snapshots", { camera }));

/** Which picture the files are for that come next; null: the one that is missing. */
export const filesFor = { side: /** @type {Side | null} */ (null) };

/** Files for one picture, and the second file for the other. @param {Iterable<File>} files */
export async function openFiles(files) {
  let s = filesFor.side ?? (pictures.value.a && !pictures.value.b ? "b" : "a");
  filesFor.side = null;
  for (const file of [...files].slice(0, 2)) {
    const body = new FormData();
    body.append("file", file, file.name);
    await bring(s, t("pair.opening", { file: file.name }), async () =>
      (await request("POST", "/snapshots", { body })).json(),
    );
    s = other(s);
  }
}

/** @param {Side} s @param {string} doing @param {() => Promise<import("../../core/types").Snapshot>} fetchIt */
async function bring(s, doing, fetchIt) {
  if (busy.value) return;
  busy.value = doing;
  try {
    const picture = await fetchIt();
    notices.value = [];
    snapshots.value = [picture, ...snapshots.value.filter((it) => it.id !== picture.id)];
    setPicture(s, picture);
  } catch (error) {
    notifyError(error);
  } finally {
    busy.value = "";
  }
}

/** @param {Side} s */
async function listSuited(s) {
  const picture = pictures.value[s];
  try {
    const found = picture
      ? (
          await call(
            "GET",
            `/calibrations?limit=50${picture.camera ? `&camera=${encodeURIComponent(picture.camera)}` : ""}`,
          )
        ).items
      : [];
    if (pictures.value[s]?.id !== picture?.id) return;
    suitedCalibrations.value = {
      ...suitedCalibrations.value,
      [s]: found.filter(
        (/** @type {import("../../core/types").Calibration} */ c) =>
          picture && String(c.image_size) === `${picture.width},${picture.height}`,
      ),
    };
  } catch (error) {
    notifyError(error);
  }
}

/** Where a picture comes from, in words. @param {Side} s */
export const sourceOf = (s) =>
  cameras.value.find((c) => c.id === pictures.value[s]?.camera)?.name ?? t("pair.source.file");

/** What is missing, in one sentence. */
export const missing = computed(() => {
  const { matches } = pair.doc.value,
    next = wantedHeight.value,
    some = calibrations.value.a !== null && calibrations.value.b !== null;
  const lacking = SIDES.find((s) => !pictures.value[s]);
  if (lacking) return t(`pair.missing.choose.${lacking}`);
  if (!next.isNew) return t(`pair.missing.click.${next.side}`, { point: next.index + 1 });
  if (some || complete.value >= ENOUGH) return "";
  if (!matches.length) return t("pair.missing.first");
  return t("pair.missing.more", { count: ENOUGH - complete.value });
});

/** Follow the address, and another tab with the same two pictures; keep every change in this browser. */
export function startPair() {
  effect(() => {
    if (route.value.view === "pair") untracked(() => void follow());
  });
  effect(() => {
    const { a, b } = pictures.value,
      document = pair.doc.value;
    if (a && b && !pair.dragging.value)
      untracked(() => {
        if (!isEqual(document, { ...EMPTY, ...read(key(a.id, b.id)) })) remember(key(a.id, b.id), document);
      });
  });
  addEventListener("storage", (event) => {
    const { a, b } = pictures.value;
    if (a && b && event.key === key(a.id, b.id) && event.newValue && !pair.dragging.value)
      pair.change({ ...EMPTY, ...JSON.parse(event.newValue) });
  });
}

/** @param {string} name */
function read(name) {
  try {
    return JSON.parse(localStorage.getItem(name) ?? "null");
  } catch {
    return null;
  }
}

/** @param {string} name @param {unknown} value */
function remember(name, value) {
  try {
    localStorage.setItem(name, JSON.stringify(value));
  } catch {
    notify({
      level: "warn",
      text: t("pair.notice.nothing-kept"),
      fix: t("pair.notice.nothing-kept.fix"),
    });
  }
}
