// What the page says, in the reader's language: t("calibrate.points-added", { count }).
import en from "./words/en.js";

/**
 * @typedef {import("./words/types").Key} Key
 * @typedef {import("./words/types").Values} Values
 * @typedef {import("./words/types").Entry} Entry
 */

const KEPT = "touchline-language";
const VALUE = /\{(\w+)\}/g;

/**
 * The catalogues, by language; any other than English is loaded where it is wanted. `statements`: what the server says,
 * by code. "pseudo" is for tests: whatever it leaves readable comes from no catalogue.
 * @type {Record<string, () => Promise<{ messages: Record<Key, Entry>, statements?: Record<string, string>,
 * pseudo?: typeof import("./words/pseudo.js").pseudo }>>}
 */
const CATALOGUES = {
  en: async () => ({ messages: en }),
  de: () => import("./words/de.js"),
  pseudo: async () => {
    const { pseudo } = await import("./words/pseudo.js");
    return { messages: pseudo(en), pseudo };
  },
};
/** The languages that an operator can choose. @type {["en", "de"]} */
export const LANGUAGES = ["en", "de"];

/** The page's language, fixed until the page is loaded again. */
export const language =
  [chosenLanguage(), ...navigator.languages]
    .map((tag) => tag.toLowerCase().split("-")[0])
    .find((it) => it in CATALOGUES) ?? "en";

/** Whose plurals, numbers, times and dates are used: English as in Great Britain, 22 Nov, 06:46. */
export const LOCALE = language === "en" || language === "pseudo" ? "en-GB" : language;

/** The decimal point: a comma in German. */
export const POINT = new Intl.NumberFormat(LOCALE)
  .formatToParts(0.1)
  .find((part) => part.type === "decimal")?.value;

// English where the other catalogue does not arrive: a page in it is better than none.
const {
  messages: catalogue,
  statements,
  pseudo,
} = await CATALOGUES[language]().catch(CATALOGUES.en);
const plurals = new Intl.PluralRules(LOCALE);
document.documentElement.lang = LOCALE;

/** The language that was chosen in this browser; "" where the browser's own counts. */
export function chosenLanguage() {
  try {
    return localStorage.getItem(KEPT) ?? "";
  } catch {
    return ""; // private windows keep nothing
  }
}

/** Load the page in another language. @param {string} to "" for the browser's own */
export function chooseLanguage(to) {
  if (to) localStorage.setItem(KEPT, to);
  else localStorage.removeItem(KEPT);
  location.reload();
}

/**
 * What the server states by this code, in the page's language; undefined where that has no words for it.
 * @param {string} code
 */
export const statement = (code) =>
  statements && Object.hasOwn(statements, code) ? statements[code] : undefined;

/** Whether there are words for what the server states; if not, its English sentences are shown. */
export const hasStatements = statements !== undefined;

/**
 * The message of a key as the catalogue has it, in the form that the count asks for.
 * @param {Key} key @param {Values} values
 * @returns {string}
 */
export function message(key, values) {
  const entry = catalogue[key];
  if (entry === undefined) throw new Error(`No message is called ${key}.`);
  return formOf(entry, values);
}

/** @param {Entry} entry @param {Values} values @returns {string} */
const formOf = (entry, values) =>
  typeof entry === "string"
    ? entry
    : (/** @type {Record<string, string>} */ (entry)[plurals.select(Number(values.count))] ??
      entry.other);

/**
 * The message of a key that ends in an id; ids that operators and cameras gave have none.
 * @param {string} key of a message without values
 * @param {string} otherwise
 */
export const nameOr = (key, otherwise) =>
  Object.hasOwn(catalogue, key) ? message(/** @type {Key} */ (key), {}) : otherwise;

/**
 * A message with its values in their places. Where it has several forms, `count` chooses.
 * @template {Key} K
 * @param {K} key
 * @param {import("./words/types").ValuesOf<K>} rest one record of values; none where the message takes none
 * @returns {string}
 */
export function t(key, ...rest) {
  const values = /** @type {Values} */ (rest[0] ?? {});
  return filled(message(key, values), values);
}

/** A text with its values in their places. @param {string} text @param {Values} values */
export const filled = (text, values) =>
  text.replace(VALUE, (_, name) => String(values[name] ?? ""));

/**
 * The t() of a feature that brings its own words, in the page's language.
 * @template {Record<string, Entry>} const M
 * @param {{ en: M, de: Record<keyof M, Entry> }} words
 * @returns {<K extends keyof M>(key: K, ...rest: import("./words/types").ValuesIn<M[K]>) => string}
 */
export function ownWords({ en: english, de }) {
  const own = language === "de" ? de : /** @type {M} */ (pseudo?.(english) ?? english);
  return (key, ...rest) => {
    const values = /** @type {Values} */ (rest[0] ?? {});
    return filled(formOf(own[key], values), values);
  };
}
