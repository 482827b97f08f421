// Numbers and times as the operator reads them: true minus, thin spaces, units, and a dash for what is not known.
import { LOCALE, POINT, nameOr, t } from "./words.js";

/** @param {number | null | undefined} value @param {number} [digits] */
export function number(value, digits = 1) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const [whole, part] = Math.abs(value).toFixed(digits).split(".");
  const grouped = whole.replace(/\B(?=(\d{3})+$)/g, "\u202f");
  const isZero = Number(Math.abs(value).toFixed(digits)) === 0;
  return (value < 0 && !isZero ? "−" : "") + grouped + (part ? POINT + part : "");
}

const LEAST_MM = 0.05; // below, one digit would say nothing
/** Millimetres with as many digits as anybody can use. @param {number | null | undefined} value */
export const mm = (value) =>
  value && Math.abs(value) < LEAST_MM
    ? `< ${number(0.1)}`
    : number(value, value !== null && value !== undefined && Math.abs(value) >= 10 ? 0 : 1);

/** @param {number | null | undefined} value */
export const pct = (value) =>
  (value !== null && value !== undefined && value >= 0.005 ? "+" : "") + number(value, 2);

/** As a title, or at the start of a sentence. @param {string} text */
export const capitalised = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/** An id that no catalogue names, for an operator or a camera gave it: "my-line" → "my line". @param {string} id */
const words = (id) => id.replaceAll("-", " ").replaceAll("_", " ");

/** A border, line, arc or landmark in a sentence: "left border", "halfway line". @param {string} id */
export const lineName = (id) => nameOr(`markings.${id}`, words(id));

/** An area of a field in a sentence: "left half", "full field". @param {string} id */
export const areaName = (id) => nameOr(`areas.${id}`, words(id));

/** The same as titles and in lists: "Left border". @param {string} id */
export const lineTitle = (id) => capitalised(lineName(id));
/** @param {string} id */
export const areaTitle = (id) => capitalised(areaName(id));

/** What an option is called; the unit stands beside the field. @param {string} id */
export const optionName = (id) =>
  nameOr(
    `calibrate.option.${id.replaceAll("_", "-")}`,
    capitalised(words(id.replace(/[_-](px|mm|deg|pct)$/, ""))),
  );

/** A label within a sentence: where nouns have no capitals, in lower case. @param {string} label */
export const inSentence = (label) => (LOCALE === "de" ? label : label.toLowerCase());

/** A name that is too long for its place, without its middle: both ends distinguish cameras.
 * @param {string} name @param {number} most characters */
export function shortened(name, most) {
  const all = [...name],
    end = Math.floor((most - 1) / 2);
  if (all.length <= most) return name;
  return `${all
    .slice(0, most - 1 - end)
    .join("")
    .trimEnd()}…${all.slice(-end).join("").trimStart()}`;
}

/** "2 s ago", "3 min ago", or the time of day. @param {number} then ms @param {number} now ms */
export function ago(then, now) {
  const seconds = Math.max(0, Math.round((now - then) / 1000));
  if (seconds < 1) return t("core.format.just-now");
  if (seconds < 60) return t("core.format.seconds-ago", { seconds });
  if (seconds < 3600) return t("core.format.minutes-ago", { minutes: Math.floor(seconds / 60) });
  return t("core.format.at-time", { time: clock(then) });
}

/** @param {number | string} when */
export const clock = (when) =>
  new Date(when).toLocaleTimeString(LOCALE, { hour: "2-digit", minute: "2-digit" });

/** @param {string} when */
export const dayAndTime = (when) =>
  new Date(when).toLocaleString(LOCALE, {
    day: "numeric",
    month: "short",
    hour: "2-digit",
    minute: "2-digit",
  });

/** A length that reads well, at or below: 0.2, 0.5, 1 … @param {number} value */
export function roundDown(value) {
  const ten = 10 ** Math.floor(Math.log10(value));
  return ([5, 2, 1].find((f) => f * ten <= value) ?? 1) * ten;
}

/** Up to so much an error is good, or fair, mm: as verdicts have it. */
export const GOOD_MM = 5,
  FAIR_MM = 15;
