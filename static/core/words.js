// What the page says, in the reader's language: t("calibrate.points-added", { count }).
import en from "./words/en.js";
import { pseudo } from "./words/pseudo.js";

/**
 * @typedef {import("./words/types").Key} Key
 * @typedef {import("./words/types").Values} Values
 */

const KEPT = "touchline-language";
const VALUE = /\{(\w+)\}/g;

/**
 * The catalogues, by language. "pseudo" is for tests: whatever it leaves readable comes from no catalogue.
 * @type {Record<string, () => Record<Key, import("./words/types").Entry>>}
 */
const CATALOGUES = { en: () => en, pseudo: () => pseudo(en) };

/** The page's language, fixed until the page is loaded again. */
export const language = [chosen(), ...navigator.languages]
  .map((tag) => tag.toLowerCase().split("-")[0])
  .find((it) => it in CATALOGUES) ?? "en";

/** Whose plurals, times and dates are used: English as it is written in Great Britain, 22 Nov, 06:46. */
export const LOCALE = language === "en" || language === "pseudo" ? "en-GB" : language;

const catalogue = CATALOGUES[language]();
const plurals = new Intl.PluralRules(LOCALE);
document.documentElement.lang = LOCALE;

function chosen() {
  try {
    return localStorage.getItem(KEPT) ?? "";
  } catch {
    return ""; // private windows keep nothing
  }
}

/**
 * The message of a key as the catalogue has it, in the form that the count asks for.
 * @param {Key} key @param {Values} values
 * @returns {string}
 */
export function message(key, values) {
  const entry = catalogue[key];
  if (entry === undefined) throw new Error(`No message is called ${key}.`);
  if (typeof entry === "string") return entry;
  return /** @type {Record<string, string>} */ (entry)[plurals.select(Number(values.count))] ?? entry.other;
}

/**
 * Whether a key that is made of an id is that of a message: ids that operators and cameras gave have none.
 * @template {string} K
 * @param {K} key
 * @returns {key is K & Key}
 */
export const has = (key) => Object.hasOwn(catalogue, key);

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
