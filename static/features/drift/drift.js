// Camera drift, and re-registration of a moved camera's pose, which is reviewed before it is used.
import { computed, effect, signal } from "@preact/signals";
import { call } from "../../core/api.js";
import { runJob } from "../../core/jobs.js";
import { longWork } from "../../core/long_work.js";
import { go } from "../../core/route.js";
import { t } from "../../core/words.js";
import { canCheck, checking } from "../check/check.js";
import { openedCamera, status } from "../live/camera_page.js";
import { activateCalibration } from "../versions/activate.js";

/**
 * @typedef {{ calibration: string, version: number, snapshot: string, parent: string, points: number, lines: number,
 * lines_px: number, picture_px: number, sentence: string }} Registered
 */

const work = longWork();
/** How far the registering is, and why it was refused. */
export const { search: registering, refusal: notRegistered } = work;
/** @typedef {{ median_mm: number | null, max_mm: number | null }} Apart from the active version */
const last = signal(
  /**
   * @type {{ camera: string, made: Registered, apart: Apart | null } | null}
   */ (null),
);
/** The version that was made for the camera on show, as long as it is not used. */
export const registered = computed(() =>
  last.value &&
  last.value.camera === openedCamera.value?.id &&
  last.value.made.calibration !== status.value?.active_calibration
    ? last.value
    : null,
);
export const canRegister = computed(
  () =>
    registering.value === null &&
    status.value?.state === "live" &&
    status.value.calibration_applied,
);

/** Take a picture without what moves, keep the lens, and fit the pose to the field's lines: a new version. */
export async function registerPose() {
  const camera = openedCamera.value?.id;
  if (!camera || !canRegister.value) return;
  last.value = null;
  await work.watch(
    (stop, onProgress) => runJob(`/cameras/${camera}/reregister`, {}, stop, onProgress),
    async (/** @type {Registered} */ made) => {
      last.value = { camera, made, apart: null };
      const apart = await call(
        "GET",
        `/calibrations/${made.parent}/difference/${made.calibration}.json`,
      ).catch(() => null);
      if (last.value?.made === made) last.value = { camera, made, apart };
    },
  );
}

/** Use the new version from now on; the one before stays. */
export async function useRegistered() {
  const it = registered.value;
  if (!it) return;
  const { camera, made } = it;
  await activateCalibration({ id: made.calibration, version: made.version, camera });
}

export const closeRegistered = () => {
  last.value = null;
};

// A refusal is of the camera that was on show.
effect(() => {
  void openedCamera.value?.id;
  notRegistered.value = null;
});

/** On the tab Drift: what is wrong, and the next thing to do. */
export const driftNextStep = computed(() => {
  const made = registered.value?.made,
    drift = status.value?.state === "live" ? status.value.drift : null,
    sentence = drift?.sentence ?? t("drift.not-watched"),
    isDone = drift?.state === "steady";
  /** @param {string} action @param {string} label */
  const step = (action, label, missing = "") => ({
    action,
    label,
    missing,
    done: isDone,
    sentence,
  });
  if (made) return step("use-registered", t("common.activate-version", { version: made.version }));
  if (drift?.state === "knocked")
    return step(
      "reregister",
      t("drift.reregister"),
      registering.value ? t("drift.being-registered") : "",
    );
  return step(
    "check-calibration",
    t("drift.check"),
    canCheck.value ? "" : checking.value ? t("drift.being-checked") : t("drift.must-be-live"),
  );
});

/** @type {import("../../core/actions.js").Action[]} */
export const DRIFT_ACTIONS = [
  {
    id: "drift",
    label: t("drift.action.show"),
    short: t("drift.action.show.short"),
    group: "pictures",
    run: () => go("drift", { camera: openedCamera.value?.id }),
    enabled: () => openedCamera.value !== null,
  },
  {
    id: "use-registered",
    label: t("drift.action.use-registered"),
    group: "pictures",
    run: () => void useRegistered(),
    enabled: () => registered.value !== null,
  },
  {
    id: "reregister",
    label: t("drift.action.reregister"),
    short: t("drift.reregister"),
    group: "pictures",
    run: () => void registerPose(),
    enabled: () => canRegister.value,
  },
  {
    id: "stop-reregister",
    label: t("drift.action.stop-reregister"),
    short: t("common.stop"),
    group: "pictures",
    run: () => registering.value?.stop.abort(),
    enabled: () => registering.value !== null,
  },
];
