// A message that holds elements: <b>, <code>, <kbd> and <small> in it become elements, its values may be elements too.
import { html } from "../core/html.js";
import { message } from "../core/words.js";

const PIECE = /<(b|code|kbd|small)>(.*?)<\/\1>|\{(\w+)\}/g;

/**
 * The message's pieces, to stand among the children of an element.
 * @template {import("../core/words/types").Key} K
 * @param {K} key
 * @param {import("../core/words/types").ValuesOf<K, any>} rest as for t(), but a value may be an element
 * @returns {any[]}
 */
export function rich(key, ...rest) {
  const values = /** @type {Record<string, any>} */ (rest[0] ?? {});
  return pieces(message(key, values), values);
}

/** @param {string} text @param {Record<string, any>} values @returns {any[]} */
function pieces(text, values) {
  const found = [];
  let end = 0;
  for (const { 0: whole, 1: tag, 2: inner, 3: name, index } of text.matchAll(PIECE)) {
    found.push(
      text.slice(end, index),
      tag ? html`<${tag}>${pieces(inner, values)}<//>` : values[name],
    );
    end = index + whole.length;
  }
  return [...found, text.slice(end)];
}
