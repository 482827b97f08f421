// The 3-D scene: one WebSocket as long as its page is open; what is shown, the view, what was clicked.
import { computed, effect, signal, untracked } from "@preact/signals";
import { address, call, online } from "../../core/api.js";
import { go, goInstead, route } from "../../core/route.js";
import { cameras, nextCamera, notifyError, pointer } from "../../core/state.js";
import { translated } from "../../core/statements.js";
import { theme } from "../../core/theme.js";
import { t } from "../../core/words.js";
import { drawsFast } from "../../canvas/graphics.js";
import { mainViewport } from "../../canvas/viewport.js";
import { openPicture } from "../calibrate/pictures.js";
import { rigs, rigsListed } from "../rigs/rig.js";

/**
 * @typedef {import("./types").SceneShown} SceneShown
 * @typedef {import("./types").SceneViewSettings} SceneViewSettings
 * @typedef {import("./types").ClickedPlace} Clicked
 */

const AGAIN_MS = 2000,
  NEAR = 3; // screen pixels per picture pixel: so near a place is shown in the point editor
const MAX_VERSIONS = 200;
/** @type {SceneViewSettings} */
const FIRST = {
  layers: ["pictures", "arrows", "footprints", "labels", "moved"],
  hidden: [],
  sheet: "none",
  scale: null,
  dark: true,
  view: "free",
  through: "",
};

/** Where the scene is, "" until it has begun. */
export const place = signal("");
export const shownScene = signal(/** @type {SceneShown | null} */ (null));
export const clicked = signal(/** @type {Clicked | null} */ (null));
export const refusal = signal(/** @type {import("../../core/types").Refusal | null} */ (null));
export const sceneView = signal(FIRST);
/** An older version to see what moved, or "". */
export const before = signal("");
/** All versions of the camera whose scene is shown, oldest first. */
export const versions = signal(/** @type {import("../../core/types").Calibration[]} */ ([]));

/** What the address names: a version's id, rig/NAME or lens/ID; null where no scene is open. */
export const what = computed(() => (route.value.view === "scene" ? route.value.scene : null));
const system = matchMedia("(prefers-color-scheme: dark)"),
  systemDark = signal(system.matches);
system.addEventListener("change", () => {
  systemDark.value = system.matches;
});
const dark = computed(() => (theme.value === "system" ? systemDark.value : theme.value === "dark"));

/** The version that is shown alone. */
export const only = computed(() =>
  shownScene.value?.cameras.length === 1 ? shownScene.value.cameras[0] : null,
);

/** Whether a scene is named: without a calibrated camera there is none. */
export const isNamed = computed(() => Boolean(what.value));

export const sceneNextStep = computed(() => {
  const it = shownScene.value,
    cannot = it?.cameras.find((c) => c.why_no_frustum),
    first = isNamed.value ? null : nextCamera.value;
  return {
    action: first ? "take" : "",
    label: first ? t("common.calibrate-camera", { camera: first.name }) : "",
    missing: "",
    done: it !== null && !refusal.value,
    sentence: refusal.value
      ? `${refusal.value.detail} ${refusal.value.fix}`
      : !isNamed.value
        ? t("scene.page.none-calibrated")
        : !it
          ? t("scene.setting-up")
          : it.boards
            ? t("scene.step.boards", { count: it.boards.boards })
            : cannot
              ? t("scene.step.no-camera")
              : t("scene.step.turn"),
  };
});

/** @type {WebSocket | null} */
let line = null;

/** @param {Record<string, unknown>} words */
function send(words) {
  if (line?.readyState === WebSocket.OPEN) line.send(JSON.stringify(words));
}

/** @param {Partial<SceneViewSettings>} changes */
export function changeView(changes) {
  sceneView.value = { ...sceneView.value, ...changes };
  const { scale, ...rest } = changes;
  send({ set: { ...rest, ...(scale === undefined || scale === null ? {} : { scale }) } });
}

/** @param {import("./types").Layer} layer */
export const toggleLayer = (layer) =>
  changeView({
    layers: sceneView.value.layers.includes(layer)
      ? sceneView.value.layers.filter((l) => l !== layer)
      : [...sceneView.value.layers, layer],
  });

/** @param {string} key of a camera */
export const toggleCamera = (key) =>
  changeView({
    hidden: sceneView.value.hidden.includes(key)
      ? sceneView.value.hidden.filter((k) => k !== key)
      : [...sceneView.value.hidden, key],
  });

// How often a picture may come: a browser that draws on the processor is not done with one before the next.
const FAST_FPS = 5,
  SLOW_FPS = 0.5;

/** What the server is asked for. @param {string} argument @param {string} older */
function wanted(argument, older) {
  const [first, name] = argument.split("/"),
    fps = drawsFast() ? FAST_FPS : SLOW_FPS;
  return {
    fps,
    ...(first === "rig"
      ? { rig: name }
      : first === "lens"
        ? { lens: name }
        : { calibrations: [first], ...(older ? { before: older } : {}) }),
  };
}

/** Open the line when a scene is looked at, close it when it is left; that ends the scene's process. */
export function startScene() {
  let timer = 0;
  effect(() => {
    void rigs.value; // they are listed anew when a camera has been calibrated
    if (what.value === "" && rigsListed.value) untracked(goToFirst);
  });
  effect(() => {
    const open = isNamed.value && online.value;
    untracked(() => {
      clearTimeout(timer);
      if (!open) return leave();
      if (!line) begin();
    });
  });
  effect(() => {
    // another version, rig or lens
    const now = what.value,
      older = before.value;
    untracked(() => {
      clicked.value = null;
      if (older && !versions.value.some((v) => v.id === now)) {
        before.value = "";
        return;
      } // another camera's
      if (now && place.value) send({ show: wanted(now, older) });
    });
  });
  effect(() => {
    const now = dark.value;
    untracked(() => changeView({ dark: now }));
  });
  effect(() => {
    const id = only.value?.camera,
      one = only.value?.calibration;
    untracked(() => void loadVersions(id ?? null, one ?? ""));
  });

  function leave() {
    line?.close();
    line = null;
    place.value = "";
    shownScene.value = clicked.value = refusal.value = null;
    before.value = "";
    sceneView.value = { ...FIRST, dark: dark.value };
  }

  function begin() {
    const to = (line = new WebSocket(address("/scene")));
    let wasIdle = false; // closed because nobody looked: then it is opened anew by hand alone
    const isCurrent = () => line === to;
    to.addEventListener("message", ({ data }) => {
      const message = translated(JSON.parse(data));
      if (!isCurrent()) return;
      if (message.address) {
        place.value = message.address;
        const { scale, ...rest } = sceneView.value;
        send({
          set: { ...rest, ...(scale === null ? {} : { scale }) },
          show: wanted(what.value ?? "", before.value),
        });
      } else if (message.shown) {
        shownScene.value = message.shown;
        refusal.value = null;
      } else if (message.clicked) clicked.value = message.clicked;
      else {
        refusal.value = message.problem ?? message; // the line's own end is a problem too
        wasIdle = String(message.type).endsWith("/scene-idle");
      }
    });
    to.addEventListener("close", () => {
      if (!isCurrent()) return;
      line = null;
      place.value = "";
      if (!wasIdle)
        timer = setTimeout(() => {
          if (what.value && !line && online.value) begin();
        }, AGAIN_MS);
    });
  }
}

/** @param {string | null} camera @param {string} shownNow */
async function loadVersions(camera, shownNow) {
  if (!camera) {
    versions.value = [];
    return;
  }
  if (versions.value[0]?.camera === camera && versions.value.some((v) => v.id === shownNow)) return;
  try {
    const { items } = await call(
      "GET",
      `/calibrations?limit=${MAX_VERSIONS}&camera=${encodeURIComponent(camera)}`,
    );
    versions.value = items.toReversed();
  } catch (error) {
    notifyError(error);
  }
}

/** Another version of the camera, by its place among all. @param {number} index */
export function showVersion(index) {
  const it = versions.value[index];
  if (it && it.id !== what.value) go("scene", { scene: it.id });
}

/** Open the point editor at the place that was clicked. @param {import("./types").PlaceIn} at */
export async function showInPicture(at) {
  if (!at.snapshot || !at.pixel) return;
  const [x, y] = at.pixel;
  await openPicture(at.snapshot, "points");
  requestAnimationFrame(() => {
    mainViewport.centre(x, y, NEAR);
    pointer.value = { x, y, touch: false, down: false };
  }); // as if it were pointed at
}

/** Where none is named: the first rig with calibrated cameras, else the first camera with an active version. */
function goToFirst() {
  const rig = rigs.value.find((r) => r.cameras.some((c) => c.calibration)),
    one = cameras.value.find((c) => c.active_calibration)?.active_calibration,
    scene = rig ? `rig/${rig.name}` : one;
  if (scene) goInstead("scene", { scene });
}
