// What the page says, in the reader's language: t("calibrate.points-added", { count }).
import en from "./words/en.js";

/**
 * @typedef {import("./words/types").Key} Key
 * @typedef {import("./words/types").Values} Values
 */

const LANGUAGE = "en";
const plurals = new Intl.PluralRules(LANGUAGE);
const VALUE = /\{(\w+)\}/g;

/**
 * The message of a key as the catalogue has it, in the form that the count asks for.
 * @param {Key} key @param {Values} values
 * @returns {string}
 */
export function message(key, values) {
  const entry = en[key];
  if (entry === undefined) throw new Error(`No message is called ${key}.`);
  if (typeof entry === "string") return entry;
  return /** @type {Record<string, string>} */ (entry)[plurals.select(Number(values.count))] ?? entry.other;
}

/**
 * A message with its values in their places. Where it has several forms, `count` chooses.
 * @template {Key} K
 * @param {K} key
 * @param {import("./words/types").ValuesOf<K>} rest one record of values; none where the message takes none
 * @returns {string}
 */
export function t(key, ...rest) {
  const values = /** @type {Values} */ (rest[0] ?? {});
  return message(key, values).replace(VALUE, (_, name) => String(values[name] ?? ""));
}
