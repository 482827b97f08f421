// The address bar: #/SNAPSHOT/STEP, so that a reload or a second tab goes on where this one stands.
import { effect } from "@preact/signals";
import { atBoard, openBoard } from "./board.js";
import { closePicture, openById } from "./pictures.js";
import { snapshot, step } from "./state.js";
import { STEPS } from "./steps.js";

const BOARD = "lens"; // no picture's id: those are hexadecimal

/** @returns {{ id: string, at: import("./types").StepId }} */
function read() {
  const [, id = "", at = ""] = location.hash.split("/");
  const known = STEPS.find((s) => s.id === at)?.id;
  return { id: decodeURIComponent(id), at: known ?? (id ? "picture" : "camera") };
}

/** Follow the address from now on, and write it. Returns once the first picture is there. */
export async function startRouter() {
  // Somebody may have opened a picture, or gone to the board, before we came so far: that, then, not the address.
  if (!snapshot.value && !atBoard.value) await follow();
  addEventListener("hashchange", () => void follow());
  effect(() => {
    const wanted = snapshot.value ? `#/${encodeURIComponent(snapshot.value.id)}/${step.value}` : atBoard.value ? `#/${BOARD}` : "#/";
    if (location.hash === wanted || (wanted === "#/" && !location.hash)) return;
    history.pushState(null, "", wanted);
  });
}

async function follow() {
  const { id, at } = read();
  if (id === BOARD) {
    closePicture();
    step.value = "camera";
    if (!atBoard.value) void openBoard();
    return;
  }
  atBoard.value = false;
  if (!id) {
    if (snapshot.value) closePicture();
    step.value = "camera";
  } else if (id !== snapshot.value?.id) await openById(id, at);
  else step.value = at;
}
