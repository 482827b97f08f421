// The address bar: #/SNAPSHOT/STEP, #/lens, #/live/CAMERA or #/pair/LEFT/RIGHT, so that a reload or a second tab goes on where this one stands.
import { computed, effect, signal } from "@preact/signals";
import { atBoard, openBoard } from "../features/board/board.js";
import { NAMES, addressOf, openPage, page } from "./page.js";
import { openPair, pictures } from "../features/pair/pair.js";
import { closePicture, openById } from "../features/calibrate/pictures.js";
import { openLive } from "../features/live/camera_page.js";
import { atLive, atPair, atStraight, snapshot, step } from "./state.js";
import { STEPS } from "../features/shell/steps.js";
import { openStraight } from "../features/straight/straight.js";

const BOARD = "lens", PAIR = "pair", STRAIGHT = "straight", LIVE = "live"; // no picture's ids: those are hexadecimal

/** @returns {{ id: string, at: import("./types").StepId }} */
function read() {
  const [, id = "", at = ""] = location.hash.split("/");
  const known = STEPS.find((s) => s.id === at)?.id;
  return { id: decodeURIComponent(id), at: known ?? (id ? "picture" : "camera") };
}

/** Whether the address leads somewhere that is not there yet: until then nothing else is shown in its place. */
export const opening = signal(location.hash.length > "#/".length);

/** The address of where the page is now. */
const here = computed(() => (page.value ? addressOf(page.value) : snapshot.value ? `#/${encodeURIComponent(snapshot.value.id)}/${step.value}` : atLive.value !== null ? `#/${LIVE}/${encodeURIComponent(atLive.value)}` : atBoard.value ? `#/${BOARD}` : atPair.value ? pairAddress() : atStraight.value ? `#/${STRAIGHT}` : "#/"));

/** Write the address from now on, and follow it once the page's lists are there. Returns when the first picture is. @param {Promise<void>} lists */
export async function startRouter(lists) {
  let following = false; // the address is read: until all is there it is not written
  effect(() => {
    const wanted = here.value, isOpening = opening.value, isNowhere = wanted === "#/" && (isOpening || !location.hash);
    if (following || isNowhere || location.hash === wanted) return;
    history.pushState(null, "", wanted);
  });
  addEventListener("hashchange", () => void lists.then(follow));
  await lists;
  // Somebody may have opened a picture, or gone to the board, before we came so far: that, then, not the address.
  if (opening.value && here.value === "#/") {
    following = true;
    await follow();
    following = false;
  }
  opening.value = false;
}

const pairAddress = () => {
  const { a, b } = pictures.value;
  return a && b ? `#/${PAIR}/${encodeURIComponent(a.id)}/${encodeURIComponent(b.id)}` : `#/${PAIR}`;
};

async function follow() {
  const { id, at } = read();
  const there = NAMES.find((one) => one === id);
  if (there) {
    const argument = location.hash.split("/").slice(2).map(decodeURIComponent).join("/");
    if (page.value?.name !== there || page.value.argument !== argument) openPage(there, argument);
    return;
  }
  page.value = null;
  if (id === BOARD || id === PAIR || id === STRAIGHT || id === LIVE) {
    const asked = location.hash, names = asked.split("/").slice(2).map(decodeURIComponent), name = names[0] ?? "";
    closePicture(); // which writes another address for a moment
    step.value = "camera";
    if (id === LIVE) { if (atLive.value !== name) openLive(name); }
    else if (id === BOARD && !atBoard.value) void openBoard();
    else if (id === STRAIGHT && !atStraight.value) void openStraight();
    else if (id === PAIR && !(atPair.value && asked === pairAddress())) await openPair(...names);
    return;
  }
  atLive.value = null;
  atBoard.value = false;
  atPair.value = false;
  atStraight.value = false;
  if (!id) {
    if (snapshot.value) closePicture();
    step.value = "camera";
  } else if (id !== snapshot.value?.id) await openById(id, at);
  else step.value = at;
}
