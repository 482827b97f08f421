// Matches as this browser keeps them: which images two cameras of a rig are matched in, and the matches in each two.
import { notify, retract } from "../../core/state.js";
import { t } from "../../core/words.js";

/** @typedef {import("./types").MatchDoc} MatchDoc @typedef {import("./types").Match} Match */

/** @type {MatchDoc} */
export const EMPTY = { pictures: null, matches: [] };

/** Where the images' ids are. @param {string} rig @param {string} a @param {string} b its cameras, in its order */
export const keyOf = (rig, a, b) => `touchline.rig.${rig}.${a}.${b}`;
/** Where their matches are: named since before pairs were those of rigs. @param {string} a @param {string} b */
const matchesKey = (a, b) => `touchline.pair.${a}.${b}`;

/** What is kept under a key. @param {string} key @returns {MatchDoc} */
export function kept(key) {
  const pictures = read(key);
  return pictures ? { pictures, matches: matchesIn(pictures.a, pictures.b) } : EMPTY;
}

/** Those that are matched in two images, whichever was the left one. @param {string} a @param {string} b */
export function matchesIn(a, b) {
  const turned = () =>
    read(matchesKey(b, a))?.matches?.map((/** @type {Match} */ m) => ({
      a: m.b,
      b: m.a,
      z_mm: m.z_mm,
    }));
  return /** @type {Match[]} */ (read(matchesKey(a, b))?.matches ?? turned() ?? []);
}

/** @param {string} key @param {MatchDoc} doc */
export function keep(key, { pictures, matches }) {
  if (!pictures) return;
  write(key, pictures);
  write(matchesKey(pictures.a, pictures.b), { matches });
}

/**
 * Whether a change of the browser's storage is one of what is kept under a key.
 * @param {string | null} changed @param {string} key
 */
export function isOf(changed, key) {
  const { pictures } = kept(key);
  return changed === key || (pictures !== null && changed === matchesKey(pictures.a, pictures.b));
}

/**
 * The complete ones, as a check takes them; null where there is none.
 * @param {string} a @param {string} b @param {Match[]} all
 * @returns {import("./types").SentMatches | null}
 */
export function sentOf(a, b, all) {
  const told = all.filter(isComplete);
  if (told.length === 0) return null;
  return {
    a,
    b,
    points_a: told.map((m) => m.a),
    points_b: told.map((m) => m.b),
    z_mm: told.map((m) => m.z_mm),
  };
}

/** All that a rig's check takes. @param {Pick<import("./types").Rig, "name" | "cameras">} rig */
export const matchesOf = ({ name, cameras }) =>
  twos(cameras.map((c) => c.camera)).flatMap(
    ([a, b]) => sentOf(a, b, kept(keyOf(name, a, b)).matches) ?? [],
  );

/** @typedef {import("../../core/types").Point} Point @param {Match} m @returns {m is Match & { a: Point, b: Point }} */
export const isComplete = (m) => m.a !== null && m.b !== null;

/** Each two of them, in their order. @template T @param {T[]} all @returns {[T, T][]} */
export const twos = (all) =>
  all.flatMap((a, i) => all.slice(i + 1).map((b) => /** @type {[T, T]} */ ([a, b])));

/** @param {string} name */
function read(name) {
  try {
    return JSON.parse(localStorage.getItem(name) ?? "null");
  } catch {
    return null;
  }
}

const ABOUT = "matches";

/** @param {string} name @param {unknown} value */
function write(name, value) {
  const text = JSON.stringify(value);
  try {
    if (localStorage.getItem(name) !== text) localStorage.setItem(name, text);
    retract(ABOUT);
  } catch {
    notify({
      level: "warn",
      text: t("rig.match.not-kept"),
      fix: t("rig.match.not-kept.fix"),
      about: ABOUT,
    });
  }
}
