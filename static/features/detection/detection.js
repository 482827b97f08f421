// Live detection on a camera: its settings, the detections of each frame, undo and redo of changes.
import { computed, effect, signal } from "@preact/signals";
import { Problem, call, online, request } from "../../core/api.js";
import { number } from "../../core/format.js";
import { requestOrder } from "../../core/latest_wins.js";
import { route } from "../../core/route.js";
import { openSocket } from "../../core/socket.js";
import { namedCamera, notifyError } from "../../core/state.js";
import { t } from "../../core/words.js";

/**
 * @typedef {import("./types").DetectionState} DetectionState
 * @typedef {import("./types").DetectionSettings} DetectionSettings
 * @typedef {import("./types").DetectionFrame} DetectionFrame
 */
/** @typedef {Pick<DetectionSettings, "plan" | "colours" | "profile">} Tuned what can be undone */

const LOOK_MS = 3000; // somebody else may change it, and a camera finds its colours by itself
const MAX_UNDO = 40,
  MAX_RECENT = 20;

export const detectionCamera = computed(() =>
  route.value.view === "detection" ? namedCamera.value : null,
);
export const detectionState = signal(/** @type {DetectionState | null} */ (null));
/** What the newest frame showed; null before the first. */
export const latestFrame = signal(/** @type {DetectionFrame | null} */ (null));
/** The newest frames, oldest first; and which one the picture shows, 0 where that is not known. */
const recent = signal(/** @type {DetectionFrame[]} */ ([]));
export const shownSeq = signal(0);
/** What is seen in the very picture that is shown: it comes another way, earlier or later. */
export const shownFrame = computed(
  () => recent.value.findLast((frame) => frame.seq <= shownSeq.value) ?? latestFrame.value,
);
/** Why nothing is detected, with its fix. */
export const refusal = signal(/** @type {import("../../core/types").Refusal | null} */ (null));
export const kinds = signal(/** @type {import("./types").StageKind[]} */ ([]));
export const plans = signal(/** @type {import("./types").Plan[]} */ ([]));
/** Whether the camera's frames are listened to; not while one is held. */
export const isListening = signal(true);
/** How it was before each change, oldest first; kept over a reload of this tab. */
export const past = signal(/** @type {Tuned[]} */ ([]));
export const future = signal(/** @type {Tuned[]} */ ([]));

export const detectionNextStep = computed(() => {
  const it = latestFrame.value,
    robots = it?.items.filter((i) => i.kind !== "ball").length ?? 0,
    balls = it?.items.filter((i) => i.kind === "ball").length ?? 0;
  const sentence = refusal.value
    ? `${refusal.value.detail} ${refusal.value.fix}`
    : !it
      ? t("detection.waiting")
      : t("detection.next.seen", {
          count: robots,
          balls: t("detection.next.balls", { count: balls }),
          time: number(it.ms, 1),
        });
  return { action: "", label: "", missing: "", done: it !== null && !refusal.value, sentence };
});

/** @type {import("../../core/socket.js").Socket | null} */
let socket = null;
const wishes = requestOrder();
let etag = "",
  saving = 0;
let queue = Promise.resolve();

/** Read and listen as long as the page is there, and again when the line breaks. */
export function startDetection() {
  let look = 0;
  const current = computed(() => detectionCamera.value?.id),
    isHeard = computed(() => isListening.value && detectionState.value?.on !== false);
  effect(() => {
    const id = current.value;
    clearInterval(look);
    if (detectionState.peek()?.camera !== id) {
      detectionState.value = latestFrame.value = null;
      [past.value, future.value] = remembered(id);
    }
    if (!id || !online.value) return;
    void read(id);
    if (!kinds.peek().length) void readStages();
    look = setInterval(() => {
      if (!document.hidden && !saving) void read(id);
    }, LOOK_MS);
  });
  effect(() => {
    const id = current.value,
      wanted = isHeard.value;
    socket?.close();
    socket = refusal.value = null;
    recent.value = [];
    shownSeq.value = 0;
    if (id && wanted && online.value) socket = listen(id);
    else if (!wanted) latestFrame.value = null; // held, or switched off
  });

  /** @param {string} id */
  function listen(id) {
    return openSocket(`/cameras/${encodeURIComponent(id)}/detections`, {
      onMessage: (message) => {
        refusal.value = "detail" in message ? message : null;
        latestFrame.value = refusal.value ? null : message;
        if (latestFrame.value)
          recent.value = [...recent.value, latestFrame.value].slice(-MAX_RECENT);
      },
    });
  }
}

async function readStages() {
  try {
    const answer = await call("GET", "/stages");
    kinds.value = answer.items;
    plans.value = answer.plans;
  } catch (error) {
    notifyError(error);
  }
}

/** @param {string} id */
async function read(id) {
  const isStill = wishes.since();
  try {
    const response = await request("GET", `/cameras/${encodeURIComponent(id)}/seeing`),
      answer = await response.json();
    if (saving || !isStill() || detectionCamera.value?.id !== id) return; // older than what is being kept, or was since
    etag = response.headers.get("ETag") ?? "";
    keep(id, answer);
  } catch (error) {
    if (!detectionState.value) notifyError(error);
  }
}

/** @param {string} id @param {Omit<DetectionState, "camera">} answer */
function keep(id, answer) {
  const next = { ...answer, camera: id };
  if (JSON.stringify(next) !== JSON.stringify(detectionState.value)) detectionState.value = next;
}

/** The profile that belongs to a camera alone. @param {DetectionState} it */
export const ownProfile = (it) =>
  it.learned === "clicks" && it.profile && it.profile.name !== it.colours ? it.profile : null;

/** What an operator has set. @param {DetectionState} it @returns {DetectionSettings} */
const setOf = (it) => ({
  on: it.on,
  plan: it.plan,
  colours: it.colours,
  profile: ownProfile(it),
  publish: it.publish,
});

/** @param {DetectionState} it @returns {Tuned} */
const tunedOf = (it) => ({ plan: it.plan, colours: it.colours, profile: ownProfile(it) });

/** Change how it sees; undo() takes it back. @param {Partial<Tuned>} changes */
export function tune(changes) {
  if (!detectionState.value) return Promise.resolve();
  past.value = [...past.value, tunedOf(detectionState.value)].slice(-MAX_UNDO);
  future.value = [];
  return setDetection(changes);
}

export const undoDetection = () => travel(past, future);
export const redoDetection = () => travel(future, past);

/** @param {typeof past} from @param {typeof past} to */
function travel(from, to) {
  const there = from.value.at(-1);
  if (!there || !detectionState.value) return;
  to.value = [...to.value, tunedOf(detectionState.value)].slice(-MAX_UNDO);
  from.value = from.value.slice(0, -1);
  void setDetection(there);
}

/** Set it: seen at once, kept by the server, one after the other. @param {Partial<DetectionSettings>} changes */
export function setDetection(changes) {
  const it = detectionState.value,
    id = it?.camera;
  if (!it || !id) return Promise.resolve();
  remember(id);
  const before = setOf(it);
  const { profile, ...rest } = changes;
  detectionState.value = {
    ...it,
    ...rest,
    ...(profile
      ? { profile, learned: /** @type {const} */ ("clicks") }
      : profile === null
        ? { profile: null, learned: null, health: [] }
        : {}),
  };
  saving += 1;
  wishes.begin();
  queue = queue
    .then(() => put(id, before, changes))
    .catch((error) => {
      notifyError(error);
      void call("GET", `/cameras/${encodeURIComponent(id)}/seeing`).then(
        (now) => {
          if (detectionCamera.value?.id === id) keep(id, now);
        },
        () => {},
      );
    })
    .finally(() => {
      saving -= 1;
    });
  return queue;
}

/** When the server has got every change so far. */
export const whenSaved = () => queue;

/** @param {string} id @param {DetectionSettings} before @param {Partial<DetectionSettings>} changes */
async function put(id, before, changes) {
  const at = `/cameras/${encodeURIComponent(id)}/seeing`;
  /** @param {DetectionSettings} onto */
  const send = async (onto) => {
    const response = await request("PUT", at, {
      json: { ...onto, ...changes },
      headers: { "If-Match": etag },
    });
    etag = response.headers.get("ETag") ?? etag;
    if (saving === 1 && detectionCamera.value?.id === id) keep(id, await response.json());
  };
  try {
    await send(before);
  } catch (error) {
    if (!(error instanceof Problem) || error.status !== 412) throw error;
    const response = await request("GET", at),
      now = setOf({ ...(await response.json()), camera: id });
    const isOurs = /** @type {(keyof DetectionSettings)[]} */ (Object.keys(changes)).every(
      (name) => JSON.stringify(now[name]) === JSON.stringify(before[name]),
    );
    etag = response.headers.get("ETag") ?? "";
    if (!isOurs) throw error; // they changed the very same: the operator is to look first
    await send(now);
  }
}

/** @param {string} id */
const keyOf = (id) => `touchline.seeing.${id}`;

/** @param {string} id */
function remember(id) {
  try {
    sessionStorage.setItem(keyOf(id), JSON.stringify([past.value, future.value]));
  } catch {
    /* full, or forbidden: undo then ends with the tab */
  }
}

/** @param {string | undefined} id @returns {[Tuned[], Tuned[]]} */
function remembered(id) {
  try {
    return JSON.parse(sessionStorage.getItem(keyOf(id ?? "")) ?? "[[],[]]");
  } catch {
    return [[], []];
  }
}
