// The way from the picture to one of the pages beside the six steps.
import { batch } from "@preact/signals";
import { leftPicture, page } from "../../core/page.js";
import { atBoard, atLive, atPair, atStraight, help, snapshot, step } from "../../core/state.js";
import { closePicture } from "../calibrate/pictures.js";

/** @param {import("../../core/page_address").PageAddress["name"]} name @param {string} [argument] */
export function openPage(name, argument = "") {
  batch(() => {
    if (snapshot.value) leftPicture.value = { id: snapshot.value.id, at: step.value };
    closePicture(); // its draft is kept; nothing unseen shall be changed by a key
    step.value = "camera";
    help.value = "";
    atBoard.value = atPair.value = atStraight.value = false;
    atLive.value = null;
    page.value = { name, argument };
  });
}
