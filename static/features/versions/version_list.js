// All versions of one camera, or of pictures from files: activate, annotate, compare, delete.
import { computed, effect, signal, untracked } from "@preact/signals";
import { call, changeSeen } from "../../core/api.js";
import { requestOrder } from "../../core/latest_wins.js";
import { route } from "../../core/route.js";
import { notify, notifyError, retract } from "../../core/state.js";
import { t } from "../../core/words.js";
import { revision, writeNote } from "./versions.js";

/** @typedef {import("./types").VersionRecord} Kept */

const PAGE = 50;
/** What is shown: of one camera, by its id; "" of pictures from files. */
export const versionList = signal(
  /**
   * @type {{ camera: string, items: Kept[], next: string | null, history: import("./types").Activation[] } | null}
   */ (null),
);
/** The two that are compared, the one chosen first being first. */
export const comparedPair = signal(/** @type {string[]} */ ([]));
export const pairDifference = signal(
  /**
   * @type {{ ids: string, is: import("./types").VersionDifference | null, why: import("../../core/types").Refusal |
   *   null } | null}
   */ (null),
);

/** The camera whose versions are shown; "": versions of pictures from files. */
export const listedCamera = computed(() => route.value.camera);
export const activeVersion = computed(() => versionList.value?.items.find((v) => v.active) ?? null);
/** What was active before the present one, and still is there. */
export const formerVersion = computed(() => {
  const now = activeVersion.value?.id,
    before = versionList.value?.history.find((h) => h.calibration !== now && h.version !== null);
  return now && before ? before : null;
});

/** Of which camera it is, in a path. @param {string} camera */
const query = (camera) => (camera ? `camera=${encodeURIComponent(camera)}` : "");

const looks = requestOrder();

/** @param {string} camera "" for pictures from files */
export async function loadVersionList(camera) {
  const isNewest = looks.begin();
  try {
    const [list, history] = await Promise.all([
      call("GET", `/calibrations?brief=true&limit=${PAGE}&${query(camera)}`),
      call("GET", `/calibrations/activations?${query(camera)}`),
    ]);
    if (!isNewest() || listedCamera.value !== camera) return; // somewhere else by now, or looked again since
    if (versionList.value?.camera !== camera) {
      comparedPair.value = [];
      pairDifference.value = null;
    }
    versionList.value = {
      camera,
      items: own(list.items, camera),
      next: list.next_cursor,
      history: history.items,
    };
  } catch (error) {
    notifyError(error);
  }
}

/** Older ones. */
export async function loadMore() {
  const it = versionList.value;
  if (!it?.next) return;
  try {
    const list = await call(
      "GET",
      `/calibrations?brief=true&limit=${PAGE}&${query(it.camera)}&cursor=${it.next}`,
    );
    versionList.value = {
      ...it,
      items: [...it.items, ...own(list.items, it.camera)],
      next: list.next_cursor,
    };
  } catch (error) {
    notifyError(error);
  }
}

/** Without a camera the server lists all. @param {Kept[]} items @param {string} camera */
const own = (items, camera) => (camera ? items : items.filter((v) => v.camera === null));

/** Do it, then look at what stands there. @param {() => Promise<unknown>} deed */
async function changing(deed) {
  try {
    await deed();
  } catch (error) {
    notifyError(error);
  }
  await loadVersionList(listedCamera.value);
}

// Another version may have become the active one, here or in a notice's Undo.
effect(() => {
  if (revision.value && untracked(() => versionList.value))
    void loadVersionList(untracked(() => listedCamera.value));
});

/** @param {Kept} it @param {string} note */
export const annotate = (it, note) =>
  note === it.note ? Promise.resolve() : changing(() => writeNote(it, note));

/** @param {Kept} it */
export const deleteVersion = (it) =>
  changing(async () => {
    await changeSeen("DELETE", `/calibrations/${it.id}`, (now) => now.note === it.note);
    comparedPair.value = comparedPair.value.filter((id) => id !== it.id);
    notify({
      level: "info",
      text: t("versions.deleted", { version: it.version }),
      fix: t("versions.deleted.fix"),
      about: `version/${it.id}`,
      action: {
        label: t("common.put-back"),
        run: () =>
          void changing(async () => {
            await call("POST", `/calibrations/${it.id}/restore`);
            retract(`version/${it.id}`);
          }),
      },
    });
  });

/** Take it among the two that are compared, or out again. @param {string} id */
export function choose(id) {
  comparedPair.value = comparedPair.value.includes(id)
    ? comparedPair.value.filter((one) => one !== id)
    : [...comparedPair.value, id].slice(-2);
  if (comparedPair.value.length === 2) void compare();
}

async function compare() {
  const [a, b] = comparedPair.value,
    ids = `${a} ${b}`;
  pairDifference.value = { ids, is: null, why: null };
  let is = null,
    why = null;
  try {
    is = await call("GET", `/calibrations/${a}/difference/${b}.json`);
  } catch (error) {
    const { message, fix = "" } = /** @type {{ message: string, fix?: string }} */ (error);
    why = { detail: message, fix };
  }
  if (pairDifference.value?.ids === ids) pairDifference.value = { ids, is, why };
}
