// The pages beside the six steps: which one is open, its address, and the way back to the picture.
import { effect, signal } from "@preact/signals";
import { atBoard, atLive, atPair, atStraight, snapshot } from "./state.js";

/** @typedef {import("./page_address").PageAddress} At */

/** @type {At["name"][]} */
// no picture's ids: those are hexadecimal
export const PAGE_NAMES = ["jobs", "settings", "versions", "capture", "rig", "rolls", "scene", "seeing"];
/** Where the page is, or null: at the steps or a desk. */
export const page = signal(/** @type {At | null} */ (null));
/** The picture that was left for it. */
export const leftPicture = signal(/** @type {{ id: string, at: import("./types").StepId } | null} */ (null));

// At one place at a time.
effect(() => {
  if (snapshot.value || atBoard.value || atPair.value || atStraight.value || atLive.value !== null)
    page.value = null;
});

/** An address of a page. @param {At} at */
export const addressOf = ({ name, argument }) =>
  `#/${name}${argument ? `/${argument.split("/").map(encodeURIComponent).join("/")}` : ""}`;

/** The address of calibrating a picture. @param {string} picture @param {import("./types").StepId} at */
export const calibrateAddress = (picture, at) => `#/${encodeURIComponent(picture)}/${at}`;

/** Back to where the operator was. */
export const backAddress = () =>
  leftPicture.value ? calibrateAddress(leftPicture.value.id, leftPicture.value.at) : "#/";
