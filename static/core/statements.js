// What the server states, in the page's language: its answers carry codes and values beside their English sentences.
import { areaName, lineName, optionName } from "./format.js";
import { POINT, filled, hasStatements, statement } from "./words.js";

/** @typedef {import("./types").Statement} Statement */

/** What is called the same in all of the page. */
const NAMES = new Map([
  ["line", lineName],
  ["area", areaName],
  ["option-name", optionName],
]);
/** Numbers and nothing but a unit, as the server writes them. */
const MEASURED = /^[\d.\s,()×±+−⁰¹²³⁴⁵⁶⁷⁸⁹⁻-]*( ?(mm|px|m|s|ms|%|°))?$/;

/**
 * The answer with its sentences in the page's language, as far as that has words for all that a sentence states.
 * @template T
 * @param {T} answer plain JSON, changed in place
 * @returns {T}
 */
export function translated(answer) {
  if (hasStatements) translate(answer);
  return answer;
}

/** @param {unknown} it */
function translate(it) {
  if (Array.isArray(it)) {
    if (typeof it[0] === "object") it.forEach(translate); // no list of numbers
    return;
  }
  if (!it || typeof it !== "object") return;
  const record = /** @type {Record<string, any>} */ (it);
  for (const value of Object.values(record)) translate(value);
  for (const [name, said] of Object.entries(record.statements ?? {})) {
    const texts = Array.isArray(said) ? said.map(inWords) : [],
      was = record[name];
    if (Array.isArray(was)) record[name] = was.map((text, i) => texts[i] ?? text); // a list has one for each text
    else if (typeof was === "string" && texts.length > 0 && !texts.includes(undefined))
      record[name] = texts.join(" ");
  }
}

/**
 * A statement in words; undefined where the language has none. Text without a code, such as a camera's name before what
 * is said of it, is the same in every language.
 * @param {Statement} it @returns {string | undefined}
 */
export function inWords(it) {
  if (it?.code === undefined && it?.text !== undefined) return it.text;
  const code = String(it?.code),
    [family, ...id] = code.split(".");
  const called = NAMES.get(family)?.(id.join("."));
  if (called) return called;
  const template = statement(code),
    values = Object.entries(it?.values ?? {}).map(([name, value]) => [name, shown(value)]);
  const isKnown = template !== undefined && values.every(([, value]) => value !== undefined);
  return isKnown ? filled(template, Object.fromEntries(values)) : undefined;
}

/** @param {import("./types").StatedValue} value @returns {string | undefined} */
function shown(value) {
  if (Array.isArray(value)) {
    const all = value.map(shown);
    return all.includes(undefined) ? undefined : all.join(", ");
  }
  if (value && typeof value === "object") return value.text ?? inWords(value);
  const text = String(value);
  return MEASURED.test(text)
    ? text.replace(/^-/, "−").replace(/(\d)\.(?=\d)/g, `$1${POINT}`)
    : text;
}
