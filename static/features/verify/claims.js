// What the server claims of a version or of the site, as a line of a list: a mark, a figure, and where it is mended.
import { mm, number } from "../../core/format.js";
import { addressOf } from "../../core/route.js";

/**
 * @typedef {import("./types").Check} Check
 * @typedef {import("./types").Claim} Claim
 * @typedef {{ snapshot?: string | null, camera?: string | null }} At the version's picture and camera
 */

/** A check with what is known of it. @param {Pick<Check, "id" | "state" | "title"> & Partial<Check>} known
 * @returns {Check} */
export const check = (known) => ({
  value: "",
  text: "",
  fix: "",
  href: "",
  isProblem: false,
  ...known,
});

/** @param {Claim} claim @param {At} [at] @returns {Check} */
export const toCheck = (claim, at = {}) =>
  check({
    id: claim.code,
    state: markOf(claim),
    title: claim.title,
    value: claim.figure ? inWords(claim.figure) : "",
    text: claim.evidence,
    fix: claim.fix,
    href: addressOfCure(claim, at),
    isProblem: claim.gates && claim.state !== "held",
  });

/** Only what was tried and held is ticked; a camera that is not calibrated yet is work to do.
 * @param {Pick<Claim, "state" | "gates" | "cure">} claim @returns {Check["state"]} */
export function markOf({ state, gates, cure }) {
  if (state === "held") return "ok";
  if (state === "not-tested") return "unknown";
  return gates && cure !== "images" ? "bad" : "note";
}

/** @param {NonNullable<Claim["figure"]>} figure */
const inWords = ({ value, unit, at_most }) =>
  `${at_most ? "≤ " : ""}${unit === "mm" ? mm(value) : number(value, 1)} ${unit}`;

/** Where it is mended, "" nowhere. @param {Pick<Claim, "cure" | "code" | "camera">} claim @param {At} [at] */
export function addressOfCure({ cure, code, camera }, at = {}) {
  const id = camera ?? at.camera ?? "",
    picture = at.snapshot;
  switch (cure) {
    case "points":
      return picture ? addressOf("calibrate", { picture, step: "points" }) : "";
    case "model": // with the lens models unfolded
      return picture ? `#/calibrate/${picture}/model` : "";
    case "camera":
      return id && addressOf("live", { camera: id });
    case "versions":
      return id && addressOf("versions", { camera: id });
    case "images":
      return id && addressOf("camera-images", { camera: id });
    case "drift":
      return id && addressOf("drift", { camera: id });
    case "rig":
      return addressOf("rig", { rig: code.replace(/^rig-/, "") });
    case "pair":
      return addressOf("field");
    case "publishing":
      return addressOf(cure);
    default:
      return "";
  }
}
