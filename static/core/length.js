// A length as people type it: "5200", "5,20 m", "520 cm". The page and the server count in millimetres.

/** @typedef {{ mm: number, unit: "mm" | "cm" | "m", isGuessed: boolean }} Length */

const MM = /** @type {const} */ ({ mm: 1, cm: 10, m: 1000 });
const GUESSES = /** @type {const} */ (["m", "cm"]);
const TYPED = /^([+-]?[\d.,\s]+)(mm|cm|m)?$/i;

/**
 * A number with a decimal comma or point, and spaces, points or commas between its thousands; NaN where it is none. A
 * single separator is the decimal one.
 * @param {string} text
 */
export function parseNumber(text) {
  const plain = text.replaceAll(/\s/g, ""),
    marks = plain.match(/[.,]/g) ?? [],
    last = marks.at(-1) ?? "",
    isDecimal = marks.filter((mark) => mark === last).length === 1;
  if (!/^[+-]?[\d.,]*\d[.,]?$/.test(plain)) return NaN;
  const end = isDecimal ? plain.lastIndexOf(last) : plain.length,
    whole = plain.slice(0, last ? end : undefined).replaceAll(/[.,]/g, "");
  if (!isDecimal && last && !/^[+-]?\d{1,3}([.,]\d{3})+$/.test(plain)) return NaN;
  return Number(last && isDecimal ? `${whole}.${plain.slice(end + 1)}` : whole);
}

/**
 * What was typed, in mm; null where it is no length. Without a unit it is millimetres; where that is out of range and
 * metres or centimetres are not, those are understood (isGuessed).
 * @param {string} text
 * @param {[number, number] | null} [range] mm
 * @returns {Length | null}
 */
export function parseLength(text, range = null) {
  const [, digits, said] = TYPED.exec(text.trim()) ?? [],
    value = parseNumber(digits ?? "");
  if (Number.isNaN(value)) return null;
  const of = (/** @type {Length["unit"]} */ unit, isGuessed = false) => ({
    mm: Number((value * MM[unit]).toPrecision(12)),
    unit,
    isGuessed,
  });
  if (said) return of(/** @type {Length["unit"]} */ (said.toLowerCase()));
  const isPossible = (/** @type {Length} */ { mm }) => !range || (mm >= range[0] && mm <= range[1]);
  if (isPossible(of("mm"))) return of("mm");
  return GUESSES.map((unit) => of(unit, true)).find(isPossible) ?? of("mm");
}
