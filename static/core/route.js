// Where the page is. The address says so and nothing else does: to go somewhere is to write an address, and what is
// shown, opened and kept alive follows it.
import { signal } from "@preact/signals";
import { unfold } from "./folds.js";
import { redirected } from "./redirects.js";

/**
 * Each view and its addresses; a view with several has the fuller one where its words are known. ":word" stands for one
 * word, "*word" for all that follow.
 * @type {[View, string][]}
 */
const ADDRESSES = [];
const STEPS = new Set(["field", "points", "verify"]);

/**
 * @typedef {import("../features/index.js").View} View
 * @typedef {"cameras" | "field" | "lenses" | "library" | "system" | ""} Place one of the rail; "" is none
 * @typedef {{ camera: string, picture: string, step: import("./types").StepId, rig: string, left: string,
 *   right: string, scene: string, field: string }} Words what an address names; "" is nothing
 * @typedef {{ view: View | "nowhere", place: Place } & Words} Route
 */

/** @type {Words} */
const NOTHING = {
  camera: "",
  picture: "",
  step: "",
  rig: "",
  left: "",
  right: "",
  scene: "",
  field: "",
};

/** @param {string} word */
function decoded(word) {
  try {
    return decodeURIComponent(word);
  } catch {
    return word; // a stray per cent sign
  }
}

/** @param {string} pattern @param {string[]} words @returns {Partial<Words> | null} */
function match(pattern, words) {
  const parts = pattern.split("/"),
    isOpen = parts.some((part) => part.startsWith("*"));
  if (isOpen ? words.length < parts.length : words.length !== parts.length) return null;
  /** @type {Record<string, string>} */
  const found = {};
  for (const [i, part] of parts.entries()) {
    if (part.startsWith("*")) found[part.slice(1)] = words.slice(i).join("/");
    else if (part.startsWith(":") && words[i]) found[part.slice(1)] = words[i];
    else if (part !== words[i]) return null;
  }
  return found;
}

/** @param {string[]} words @returns {Route | null} */
function routeOf(words) {
  for (const [view, pattern] of ADDRESSES) {
    const found = match(pattern, words);
    if (!found || (found.step && !STEPS.has(found.step))) continue;
    const place = /** @type {Place} */ (words[0] === "calibrate" ? "cameras" : words[0]);
    return { view, place, ...NOTHING, ...found };
  }
  return null;
}

/** @param {string} address from the number sign on */
const wordsOf = (address) =>
  address
    .replace(/^#?\/?/, "")
    .split("/")
    .map(decoded);
/** @param {string[]} words */
const written = (words) => `#/${words.map(encodeURIComponent).join("/")}`;

/** Where the page is; nowhere, until the views are registered. */
export const route = signal(/** @type {Route} */ ({ view: "nowhere", place: "", ...NOTHING }));

/** Add views and their addresses, and go where the address bar says. @param {[View, string][]} addresses */
export function registerAddresses(addresses) {
  ADDRESSES.push(...addresses);
  route.value = follow();
}

/** The route of the address bar; a former address is replaced by the present one. @returns {Route} */
function follow() {
  const words = wordsOf(location.hash),
    there = redirected(words);
  if (there?.[2] === "model") {
    unfold("lens");
    there[2] = "points";
  }
  if (there) history.replaceState(null, "", written(there));
  return routeOf(there ?? words) ?? { view: "nowhere", place: "", ...NOTHING };
}
addEventListener("hashchange", () => {
  route.value = follow();
});

/**
 * The address of a view.
 * @param {View} view
 * @param {Partial<Words>} [words]
 */
export function addressOf(view, words = {}) {
  for (const [name, pattern] of ADDRESSES) {
    const parts = pattern.split("/"),
      of = (/** @type {string} */ part) => words[/** @type {keyof Words} */ (part.slice(1))] ?? "";
    if (name === view && parts.every((part) => !/^[:*]/.test(part) || of(part)))
      return written(
        parts.flatMap((part) =>
          part.startsWith(":") ? of(part) : part.startsWith("*") ? of(part).split("/") : part,
        ),
      );
  }
  throw new Error(`No address of ${view} with ${JSON.stringify(words)}`);
}

/** @param {"pushState" | "replaceState"} how @param {string} address */
function write(how, address) {
  if (location.hash === address) return;
  history[how](null, "", address);
  route.value = follow();
}

/** Go to a view. @param {View} view @param {Partial<Words>} [words] */
export const go = (view, words) => write("pushState", addressOf(view, words));
/** The same view by its fuller address, or the one to be in its stead: the way back leads past it.
 * @param {View} view @param {Partial<Words>} [words] */
export const goInstead = (view, words) => write("replaceState", addressOf(view, words));

/** Another step of calibrating the same picture. @param {import("./types").StepId} step */
export const goToStep = (step) => go("calibrate", { picture: route.value.picture, step });
