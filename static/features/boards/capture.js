// A board before a live camera: what the server detects of it, the views taken so far, and the view it asks for next.
import { computed, effect, signal } from "@preact/signals";
import { online } from "../../core/api.js";
import { route } from "../../core/route.js";
import { openSocket } from "../../core/socket.js";
import { namedCamera } from "../../core/state.js";
import { t } from "../../core/words.js";
import { addCapturedView, boardRequest, findLens, openBoard, pictures } from "./board.js";

const GOOD = 12; // views from which a lens is worth finding

/** @typedef {import("./types").BoardView} Look */

/** What was seen last; null before the first look. */
export const boardView = signal(/** @type {Look | null} */ (null));
/** Why there is none, with its fix. */
export const refusal = signal(/** @type {import("../../core/types").Refusal | null} */ (null));
/** Whether pictures are taken by themselves. */
export const automatic = signal(true);
export const captureCamera = computed(() =>
  route.value.view === "capture" ? namedCamera.value : null,
);
/** The views that were taken before this camera. */
export const views = computed(() =>
  pictures.value.filter((p) => p.quad && p.camera === captureCamera.value?.id),
);

/** @type {import("../../core/socket.js").Socket | null} */
let socket = null;

export const captureNextStep = computed(() => {
  const it = boardView.value,
    count = views.value.length;
  const sentence = refusal.value
    ? `${refusal.value.detail} ${refusal.value.fix}`
    : !it
      ? t("lens-pictures.waiting-for-camera")
      : it.wanted
        ? t("board.capture.wanted", { count, wanted: it.wanted.text })
        : t("board.capture.enough", { count });
  return {
    action: "find-captured",
    label: t("board.find-lens"),
    missing: count < 3 ? t("board.capture.fewest") : "",
    done: count >= GOOD && !it?.wanted,
    sentence,
  };
});

/** What the server is to look for. */
function board() {
  const { kind, columns, rows, square_mm, marker_mm, dictionary, legacy } = boardRequest.value;
  return {
    kind,
    columns,
    rows,
    square_mm,
    ...(kind === "charuco" ? { marker_mm, dictionary, legacy } : {}),
  };
}

/** Look for the board as long as the page is there, and again when the line breaks or another board is chosen. */
export function startCapture() {
  const boards = computed(() => JSON.stringify(board()));
  effect(() => {
    const id = captureCamera.value?.id,
      which = boards.value;
    socket?.close();
    socket = null;
    boardView.value = null;
    refusal.value = null;
    if (id && online.value) socket = open(id, which);
  });

  /** @param {string} id @param {string} which */
  function open(id, which) {
    return openSocket(`/cameras/${encodeURIComponent(id)}/board`, {
      onOpen: () =>
        socket?.send({
          board: JSON.parse(which),
          taken: views.peek().map((v) => v.quad),
          automatic: automatic.peek(),
        }),
      onMessage: (now) => {
        refusal.value = "detail" in now ? now : null;
        boardView.value = refusal.value ? null : now;
        if (now.taken) addCapturedView(now.taken.id, id, now.quad);
      },
    });
  }
}

export function switchAutomatic() {
  automatic.value = !automatic.value;
  socket?.send({ automatic: automatic.value });
}

/** This very view, whether it is still and new or not. */
export const takeView = () => socket?.send({ take: true });

/** With what was taken, at the board's desk. */
export async function findCaptured() {
  await openBoard();
  await findLens();
}
