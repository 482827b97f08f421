// A ball rolling before a live camera: moving objects, each straight roll, and the lens fitted to the rolls.
import { computed, effect, signal } from "@preact/signals";
import { online, request } from "../../core/api.js";
import { number, pct } from "../../core/format.js";
import { runJob } from "../../core/jobs.js";
import { longWork } from "../../core/long_work.js";
import { route } from "../../core/route.js";
import { openSocket } from "../../core/socket.js";
import { namedCamera, notifyError } from "../../core/state.js";
import { t } from "../../core/words.js";

const DOUBT_MS = 5000;
const GOOD = 5; // rolls that are worth having
const FEWEST = 3;
const STANDARD_PCT = 3; // a standard lens' distortion, section IV of the method

/**
 * @typedef {import("./types").MovingTracks} Moving
 * @typedef {import("./types").RollsResponse} RollsResponse
 * @typedef {import("./types").SavedRoll} SavedRoll
 */

/** What moves now; null before the first look. */
export const movingTracks = signal(/** @type {Moving | null} */ (null));
/** Every roll that is kept, and what all say. */
export const rollsResponse = signal(/** @type {RollsResponse | null} */ (null));
/** Why nothing arrives, with its fix. */
export const refusal = signal(/** @type {import("../../core/types").Refusal | null} */ (null));
/** Whether the numbers of the corrected picture are wanted, where there are any. */
export const wantsCorrected = signal(true);
/** The roll that is pointed at, by its id. */
export const pointed = signal("");
/** The lens that is looked for. */
export const kind = signal("auto");
const work = longWork();
export const { search, refusal: workRefusal } = work;
/** What came of it last. */
export const fittedLens = signal(
  /** @type {{ lens: string | null, calibration: string | null } | null} */ (null),
);

export const rollsCamera = computed(() => (route.value.view === "ball" ? namedCamera.value : null));
export const hasCorrected = computed(() => Boolean(rollsResponse.value?.report?.corrected));
/** Which numbers are shown. */
export const view = computed(
  () =>
    /** @type {"raw" | "corrected"} */ (
      wantsCorrected.value && hasCorrected.value ? "corrected" : "raw"
    ),
);
export const all = computed(() => rollsResponse.value?.report?.[view.value] ?? null);
export const deceleration = computed(() => rollsResponse.value?.deceleration ?? null);
/** Newest first. */
export const rolls = computed(() => (rollsResponse.value?.items ?? []).toReversed());
export const counted = computed(() => rolls.value.filter((roll) => roll.counts && !roll.left_out));
/** The one that was left out last, of those that still are. @type {import("@preact/signals").Signal<string[]>} */
const leftOut = signal([]);
export const canInclude = computed(() =>
  rolls.value.some((roll) => roll.left_out && roll.id === leftOut.value.at(-1)),
);

/** Of all rolls together: good, fair, poor, or unknown. */
export const level = computed(() => {
  const { border_pct: value = null, border_sigma_pct: sigma = null } = all.value ?? {};
  if (value === null || sigma === null || sigma > STANDARD_PCT || !all.value?.free)
    return "unknown";
  return Math.abs(value) <= 2 * sigma ? "good" : Math.abs(value) <= STANDARD_PCT ? "fair" : "poor";
});

export const rollsNextStep = computed(() => {
  const count = counted.value.length;
  const sentence = refusal.value
    ? `${refusal.value.detail} ${refusal.value.fix}`
    : !movingTracks.value
      ? t("lens-pictures.waiting-for-camera")
      : !count
        ? t("rolling.next-step.let-roll")
        : count < GOOD
          ? t("rolling.next-step.so-far", { count, good: GOOD })
          : t("rolling.next-step.bow", {
              count,
              bow: pct(all.value?.border_pct),
              sigma: number(all.value?.border_sigma_pct, 2),
            });
  return {
    action: "fit-rolls",
    label: t("rolling.fit-lens"),
    missing:
      count < FEWEST ? t("rolling.next-step.fewest") : search.value ? t("common.server-busy") : "",
    done: count >= GOOD,
    sentence,
  };
});

/** @type {import("../../core/socket.js").Socket | null} */
let socket = null;

/** Listen as long as the page is there, and again when the line breaks. */
export function startRolls() {
  effect(() => {
    const id = rollsCamera.value?.id;
    socket?.close();
    socket = movingTracks.value = refusal.value = null;
    if (rollsResponse.peek()?.camera !== id) {
      rollsResponse.value = fittedLens.value = null;
      leftOut.value = [];
      work.refusal.value = null;
    }
    if (id && online.value) socket = listen(id);
  });

  /** @param {string} id */
  function listen(id) {
    return openSocket(`/cameras/${encodeURIComponent(id)}/rolls/stream`, {
      onMessage: (message) => {
        refusal.value = "detail" in message ? message : null;
        movingTracks.value = refusal.value ? null : message;
        if (message.told) rollsResponse.value = { ...message.told, camera: id };
      },
    });
  }
}

/** @param {string} id @param {boolean} out */
export async function excludeRoll(id, out) {
  const camera = rollsCamera.value?.id,
    roll = rolls.value.find((one) => one.id === id);
  if (!camera || !roll) return;
  try {
    const response = await request("PATCH", `/cameras/${encodeURIComponent(camera)}/rolls/${id}`, {
      json: { left_out: out },
      headers: { "If-Match": roll.etag },
    });
    const now = await response.json();
    leftOut.value = out ? [...leftOut.value, id] : leftOut.value.filter((one) => one !== id);
    if (rollsCamera.value?.id === camera) rollsResponse.value = { ...now, camera };
  } catch (error) {
    notifyError(error);
  }
}

/** Whether the next press forgets all. */
export const forgetting = signal(false);
let doubt = 0;

export const excludeNewest = () => {
  if (counted.value[0]) void excludeRoll(counted.value[0].id, true);
};
export const includeRolls = () => {
  const id = leftOut.value.at(-1);
  if (id) void excludeRoll(id, false);
};

export async function forgetRolls() {
  const camera = rollsCamera.value;
  if (!camera) return;
  clearTimeout(doubt);
  if (!forgetting.value) {
    // they cannot be had back: it takes two
    forgetting.value = true;
    doubt = setTimeout(() => {
      forgetting.value = false;
    }, DOUBT_MS);
    return;
  }
  forgetting.value = false;
  try {
    await request("DELETE", `/cameras/${encodeURIComponent(camera.id)}/rolls`, {
      headers: { "If-Match": rollsResponse.value?.etag ?? "" },
    });
    rollsResponse.value = {
      items: [],
      report: null,
      deceleration: null,
      camera: camera.id,
      etag: "",
    };
  } catch (error) {
    notifyError(error);
  }
}

/** @param {"lens" | "refined"} make */
export function fitFromRolls(make) {
  const camera = rollsCamera.value?.id;
  return work.watch(
    (stop, how) => runJob("/motion", { camera, make, lens: kind.value }, stop, how),
    ({ lens, calibration }) => {
      fittedLens.value = { lens, calibration };
    },
  );
}
