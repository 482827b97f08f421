// The address bar: #/SNAPSHOT/STEP, so that a reload or a second tab goes on where this one stands.
import { effect } from "@preact/signals";
import { atBoard, openBoard } from "./board.js";
import { closePicture, openById } from "./pictures.js";
import { atStraight, snapshot, step } from "./state.js";
import { STEPS } from "./steps.js";
import { openStraight } from "./straight.js";

const BOARD = "lens", STRAIGHT = "straight"; // no picture's ids: those are hexadecimal

/** @returns {{ id: string, at: import("./types").StepId }} */
function read() {
  const [, id = "", at = ""] = location.hash.split("/");
  const known = STEPS.find((s) => s.id === at)?.id;
  return { id: decodeURIComponent(id), at: known ?? (id ? "picture" : "camera") };
}

/** Follow the address from now on, and write it. Returns once the first picture is there. */
export async function startRouter() {
  // Somebody may have opened a picture, or gone to the board, before we came so far: that, then, not the address.
  if (!snapshot.value && !atBoard.value && !atStraight.value) await follow();
  addEventListener("hashchange", () => void follow());
  effect(() => {
    const wanted = snapshot.value ? `#/${encodeURIComponent(snapshot.value.id)}/${step.value}` : atBoard.value ? `#/${BOARD}` : atStraight.value ? `#/${STRAIGHT}` : "#/";
    if (location.hash === wanted || (wanted === "#/" && !location.hash)) return;
    history.pushState(null, "", wanted);
  });
}

async function follow() {
  const { id, at } = read();
  if (id === BOARD || id === STRAIGHT) {
    closePicture();
    step.value = "camera";
    if (id === BOARD && !atBoard.value) void openBoard();
    else if (id === STRAIGHT && !atStraight.value) void openStraight();
    return;
  }
  atBoard.value = false;
  atStraight.value = false;
  if (!id) {
    if (snapshot.value) closePicture();
    step.value = "camera";
  } else if (id !== snapshot.value?.id) await openById(id, at);
  else step.value = at;
}
