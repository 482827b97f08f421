// Addresses of the page (#/SNAPSHOT/STEP, #/lens, #/straight, #/live/CAMERA, #/pair/LEFT/RIGHT, #/rig/NAME …), and how
// each is followed.
import { batch, computed } from "@preact/signals";
import { PAGE_NAMES, addressOf, calibrateAddress, page } from "../../core/page.js";
import { unfold } from "../../core/folds.js";
import { atBoard, atLive, atPair, atStraight, snapshot, step } from "../../core/state.js";
import { openBoard } from "../board/board.js";
import { closePicture, forgetOpening, openById } from "../calibrate/pictures.js";
import { openLive } from "../live/camera_page.js";
import { openPair, pictures } from "../pair/pair.js";
import { openStraight } from "../straight/straight.js";
import { openPage } from "./open_page.js";
import { STEPS } from "./steps.js";

/** @typedef {import("../../core/types").StepId} StepId */

const BOARD = "lens",
  PAIR = "pair",
  STRAIGHT = "straight",
  LIVE = "live"; // no picture's ids: those are hexadecimal

/** What steps were called in addresses that somebody may have kept. @type {Record<string, StepId>} */
const FORMER = { picture: "field", borders: "points", model: "points", compare: "verify", activate: "verify" };

/** @returns {{ id: string, at: StepId }} */
function read() {
  const [, id = "", at = ""] = location.hash.split("/").map(decodeURIComponent);
  const known = STEPS.find((s) => s.id === at)?.id ?? FORMER[at];
  return { id, at: known ?? (id ? "field" : "camera") };
}

/** The address of where the page is now. */
export const here = computed(() =>
  page.value
    ? addressOf(page.value)
    : snapshot.value
      ? calibrateAddress(snapshot.value.id, step.value)
      : atLive.value !== null
        ? `#/${LIVE}/${encodeURIComponent(atLive.value)}`
        : atBoard.value
          ? `#/${BOARD}`
          : atPair.value
            ? pairAddress()
            : atStraight.value
              ? `#/${STRAIGHT}`
              : "#/",
);

const pairAddress = () => {
  const { a, b } = pictures.value;
  return a && b ? `#/${PAIR}/${encodeURIComponent(a.id)}/${encodeURIComponent(b.id)}` : `#/${PAIR}`;
};

/** Go where the address bar says. */
export async function follow() {
  forgetOpening();
  const { id, at } = read();
  const there = PAGE_NAMES.find((one) => one === id);
  if (there) {
    const argument = location.hash.split("/").slice(2).map(decodeURIComponent).join("/");
    if (page.value?.name !== there || page.value.argument !== argument) openPage(there, argument);
    return;
  }
  if (id === BOARD || id === PAIR || id === STRAIGHT || id === LIVE) {
    const names = location.hash.split("/").slice(2).map(decodeURIComponent),
      name = names[0] ?? "";
    // At once: an address that is written on the way would be met by a reload, and by the way back.
    return batch(() => {
      page.value = null;
      closePicture();
      step.value = "camera";
      if (id === LIVE) {
        if (atLive.value !== name) openLive(name);
      } else if (id === BOARD && !atBoard.value) void openBoard();
      else if (id === STRAIGHT && !atStraight.value) void openStraight();
      else if (id === PAIR && !(atPair.value && location.hash === pairAddress())) return openPair(...names);
    });
  }
  page.value = null;
  atLive.value = null;
  atBoard.value = false;
  atPair.value = false;
  atStraight.value = false;
  if (id) {
    if (location.hash.split("/")[2] === "model") unfold("lens");
    history.replaceState(null, "", calibrateAddress(id, at));
  }
  if (!id) {
    if (snapshot.value) closePicture();
    step.value = "camera";
  } else if (id !== snapshot.value?.id) await openById(id, at);
  else step.value = at;
}
