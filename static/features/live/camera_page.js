// One camera, live, and the form for a new or a changed one: state and actions.
import { computed, effect, signal, untracked } from "@preact/signals";
import { ServerUnreachable, call, changeSeen, request, toRefusal } from "../../core/api.js";
import { go, goInstead, route } from "../../core/route.js";
import { cameras, listed, namedCamera, notify, notifyError, retract } from "../../core/state.js";
import { t } from "../../core/words.js";
import { readCameras } from "../calibrate/pictures.js";
import { STATES, refreshStatuses, statuses } from "./camera_status.js";

/**
 * @typedef {import("../../core/types").Camera} Camera
 * @typedef {{ id: string, name: string, source: string, field: string | null, region: string | null }} CameraForm
 */

/** How the camera is looked at. */
export const cameraView = signal(
  /** @type {{ view: import("../../core/types").CompareMode, lines: boolean }} */ ({
    view: "raw",
    lines: false,
  }),
);
/** What stands in the form; null: it is closed. etag: of the camera that is changed, "" of a new one. */
export const form = signal(/** @type {{ values: CameraForm, etag: string } | null} */ (null));
/** The picture of the source that was tried, and for which address. */
export const testedSource = signal(
  /** @type {{ source: string, picture: string, width: number, height: number, fps: number } | null} */ (
    null
  ),
);
export const sourceTest = signal(/** @type {AbortController | null} */ (null));
export const refusal = signal(/** @type {import("../../core/types").Refusal | null} */ (null));
/** What can be set on the camera, as it was read back. */
export const controls = signal(
  /** @type {{ id: string, items: import("../../core/types").Control[] } | null} */ (null),
);
/** What is plugged in; null before anybody looked. */
export const discoveredCameras = signal(
  /** @type {{ address: string, title: string }[] | null} */ (null),
);
export const sourceKinds = signal(/** @type {import("../../core/types").SourceKind[]} */ ([]));

/** Whether its live picture is what is looked at. */
export const atLive = computed(() => route.value.view === "live");
/** The camera that the page is at. */
export const openedCamera = computed(() =>
  route.value.place === "cameras" ? namedCamera.value : null,
);
export const status = computed(() =>
  openedCamera.value ? (statuses.value[openedCamera.value.id] ?? null) : null,
);

/** Not so a camera of the settings file. */
export const isEditable = computed(() => namedCamera.value?.editable !== false);

/** What the form of a camera still wants. */
export const formNextStep = computed(() => {
  const values = form.value?.values;
  if (!isEditable.value)
    return {
      action: "",
      label: "",
      missing: "",
      done: false,
      sentence: t("live.form.in-settings-file"),
    };
  if (values && testedSource.value?.source === values.source)
    return {
      action: "keep-camera",
      label: t("live.action.keep-camera"),
      missing: values.id ? "" : t("live.next.short-name"),
      done: true,
      sentence: t("live.next.source-works"),
    };
  return {
    action: "try-camera",
    label: t("live.action.try-camera.short"),
    missing: sourceTest.value
      ? t("live.next.being-tried")
      : values?.source
        ? ""
        : t("live.next.say-source"),
    done: false,
    sentence: t("live.next.say-and-try"),
  };
});

/** How the camera is, and the next thing to do. */
export const cameraNextStep = computed(() => {
  const now = status.value;
  if (now?.state === "mismatch")
    return {
      action: "confirm-camera",
      label: t("live.same-camera"),
      missing: now.problem?.reason === "other-camera" ? "" : (now.problem?.fix ?? ""),
      done: false,
      sentence: now.problem?.what ?? "",
    };
  if (now?.drift?.alarm)
    return {
      action: "drift",
      label: t("live.next.see-drift"),
      missing: "",
      done: false,
      sentence: now.drift.sentence,
    };
  const camera = openedCamera.value?.name; // none before the list of cameras is there
  return {
    action: "take-live",
    label: camera ? t("live.next.take-picture", { camera }) : t("live.action.take-live"),
    missing: now && now.state !== "live" ? `${STATES[now.state]}. ${now.problem?.what ?? ""}` : "",
    done: now?.state === "live",
    sentence: now?.problem
      ? `${now.problem.what} ${now.problem.fix}`
      : (now?.words[0]?.text ?? t("live.next.is-live")),
  };
});

// What can be set is known once the camera gives pictures.
effect(() => {
  const it = openedCamera.value,
    state = status.value?.state;
  if (it && (state === "live" || state === "mismatch") && controls.peek()?.id !== it.id)
    void readControls(it.id);
});

/** Open the form when the address says so, close it when the page goes elsewhere; a camera is first seen as it is. */
export function startCameraForm() {
  const wanted = computed(() =>
    !listed.value
      ? null
      : route.value.view === "new-camera"
        ? ""
        : route.value.view === "camera-form"
          ? route.value.camera
          : null,
  );
  effect(() => {
    const id = wanted.value;
    untracked(() => {
      sourceTest.value?.abort();
      form.value = null;
      const camera = cameras.value.find((c) => c.id === id) ?? null;
      if (id === "" || camera) void openForm(camera);
    });
  });
  const looked = computed(() => (atLive.value ? route.value.camera : ""));
  effect(() => {
    if (looked.value) untracked(() => (cameraView.value = { ...cameraView.value, view: "raw" }));
  });
}

/** @param {Camera | null} camera null: a new one */
async function openForm(camera) {
  refusal.value = testedSource.value = null;
  const from = route.value;
  try {
    void discoverCameras();
    if (!sourceKinds.value.length)
      sourceKinds.value = (await call("GET", "/cameras/sources")).items;
    const etag = camera
      ? ((await request("GET", `/cameras/${camera.id}`)).headers.get("ETag") ?? "")
      : "";
    if (route.value !== from) return;
    form.value = {
      values: camera
        ? {
            id: camera.id,
            name: camera.name,
            source: camera.source,
            field: camera.field,
            region: camera.region,
          }
        : { id: "", name: "", source: "", field: null, region: null },
      etag,
    };
  } catch (error) {
    notifyError(error);
  }
}

/** Look for cameras that are plugged in. */
export async function discoverCameras() {
  discoveredCameras.value = null;
  try {
    discoveredCameras.value = (await call("GET", "/cameras/found")).items;
  } catch {
    discoveredCameras.value = [];
  }
}

/** Back from the form. */
export const closeForm = () =>
  form.value?.etag ? go("live", { camera: form.value.values.id }) : go("wall");

/** @param {Partial<CameraForm>} changes */
export function setFormValue(changes) {
  if (form.value) form.value = { ...form.value, values: { ...form.value.values, ...changes } };
}

/** Open the source once and look at its picture. */
export async function tryCamera() {
  const source = form.value?.values.source;
  if (!source) return;
  const stop = (sourceTest.value = new AbortController());
  refusal.value = testedSource.value = null;
  try {
    const answer = await request("POST", "/cameras/test", { json: { source }, stop: stop.signal });
    testedSource.value = { source, ...(await answer.json()) };
  } catch (error) {
    if (!stop.signal.aborted)
      refusal.value =
        error instanceof ServerUnreachable
          ? { detail: error.message, fix: t("common.try-later") }
          : toRefusal(error);
  } finally {
    if (sourceTest.value === stop) sourceTest.value = null;
  }
}

/** Keep what stands in the form. */
export async function saveCamera() {
  const it = form.value;
  if (!it) return;
  const { id, ...rest } = it.values;
  try {
    const kept = await (
      it.etag
        ? request("PATCH", `/cameras/${id}`, { json: rest, headers: { "If-Match": it.etag } })
        : request("POST", "/cameras", { json: it.values })
    ).then((a) => a.json());
    cameras.value = it.etag
      ? cameras.value.map((c) => (c.id === id ? kept : c))
      : [...cameras.value, kept];
    goInstead("live", { camera: kept.id });
    void refreshStatuses();
  } catch (error) {
    refusal.value = toRefusal(error);
  }
}

/** @param {Camera} camera */
export async function removeCamera(camera) {
  try {
    await changeSeen(
      "DELETE",
      `/cameras/${camera.id}`,
      (now) => now.updated_at === camera.updated_at,
    );
    cameras.value = cameras.value.filter((c) => c.id !== camera.id);
    goInstead("wall");
    const again = () =>
      request("POST", "/cameras", {
        json: {
          id: camera.id,
          name: camera.name,
          source: camera.source,
          field: camera.field,
          region: camera.region,
        },
      }).then(async (a) => {
        cameras.value = [...cameras.value, await a.json()];
        retract(`camera/${camera.id}`);
      }, notifyError);
    notify({
      level: "info",
      text: t("live.removed", { camera: camera.name }),
      fix: "",
      about: `camera/${camera.id}`,
      action: camera.source.includes("@")
        ? undefined
        : { label: t("common.put-back"), run: () => void again() },
    });
  } catch (error) {
    notifyError(error);
    await readCameras().catch(() => {});
  }
}

export async function confirmCamera() {
  try {
    const { id, active_calibration: seen } = openedCamera.value ?? {};
    await request("POST", `/cameras/${id}/confirm`, { headers: seen ? { "If-Match": seen } : {} });
    await refreshStatuses();
  } catch (error) {
    notifyError(error);
  }
}

/** @param {string} id */
async function readControls(id) {
  try {
    const { items } = await call("GET", `/cameras/${id}/controls`);
    if (openedCamera.value?.id === id) controls.value = { id, items };
  } catch {
    /* a camera that is off has nothing to set */
  }
}

/** Set one, and show what the camera says it is afterwards. @param {string} name @param {unknown} value */
export async function setControl(name, value) {
  const at = controls.value;
  if (!at) return;
  try {
    const { items } = await call("PATCH", `/cameras/${at.id}/controls`, {
      controls: { [name]: value },
    });
    const [set] = items;
    if (controls.value?.id === at.id)
      controls.value = {
        ...at,
        items: controls.value.items.map((c) => (c.name === name ? set : c)),
      };
  } catch (error) {
    controls.value = { ...at }; // draw the old value again
    notifyError(error);
  }
}
