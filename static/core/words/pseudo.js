// A language for tests: English in letters that no reader takes for English, a third longer.

/** @typedef {import("./types").Entry} Entry */

const PLAIN = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ",
  STRANGE = "åƀçðéƒĝĥîĵķļɱñöþǫŕšţûṽŵẋýžÅƁÇÐÉƑĜĤÎĴĶĻṀÑÖÞǪŔŠŢÛṼŴẊÝŽ";
const UNTOUCHED = /(\{\w+\}|<\/?\w+>)/; // values and elements
const LONGER = 0.3; // as much as German is

/** @param {string} text */
function written(text) {
  const letters = text
    .split(UNTOUCHED)
    .map((piece, i) => (i % 2 ? piece : piece.replace(/[a-z]/gi, (it) => STRANGE[PLAIN.indexOf(it)])))
    .join("");
  return letters + "·".repeat(Math.ceil(LONGER * text.length));
}

/**
 * @template {string} K
 * @param {Record<K, Entry>} catalogue
 * @returns {Record<K, Entry>}
 */
export function pseudo(catalogue) {
  const entries = Object.entries(/** @type {Record<string, Entry>} */ (catalogue)).map(([key, entry]) => [
    key,
    typeof entry === "string" ? written(entry) : { one: written(entry.one), other: written(entry.other) },
  ]);
  return Object.fromEntries(entries);
}
