// The one question that an accuracy may depend on: from straight above, height and focal length look the same.
import { computed } from "@preact/signals";
import { doc } from "../../core/document.js";
import { model } from "../../core/state.js";
import { preview } from "./fitting.js";

const HEIGHT = "height_mm",
  UNKNOWN = "height-unknown"; // the warning of a fit

/** @param {import("../../core/types").Report} report */
const isHeightUnknown = (report) => report.warnings.some((w) => w.reason === UNKNOWN);

/**
 * The expected error at robot tops, mm; null where it is not known.
 * @param {import("../../core/types").Report} report `known` is absent in one of an older server
 */
export function robotTopsMm(report) {
  const hat = report.sigma_mm?.hat;
  return !hat || hat.known === false ? null : hat.rms;
}

/** The option to ask for beside the accuracy: where the fit wants it, or it was given; else null. */
export const askedHeight = computed(() => {
  const isWanted = preview.value !== null && isHeightUnknown(preview.value.report),
    isGiven = HEIGHT in doc.value.options;
  return ((isWanted || isGiven) && model.value?.options.find((o) => o.name === HEIGHT)) || null;
});
