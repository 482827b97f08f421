// Addresses of former versions, which somebody may have kept or written down, and where they lead now.

/** What steps were called. @type {Record<string, string>} */
const FORMER_STEPS = {
  camera: "field",
  picture: "field",
  borders: "points",
  compare: "verify",
  activate: "verify",
};
const STEPS = new Set(["field", "points", "verify", "model"]);

/** By the first word; the words after it follow. @type {Record<string, (...rest: string[]) => string[]>} */
const FORMER = {
  "": () => ["cameras"],
  live: (camera) => (camera === "new camera" ? ["cameras", "new"] : ["cameras", camera, "live"]),
  seeing: (camera) => ["cameras", camera, "detection"],
  versions: (camera) => (camera ? ["cameras", camera, "versions"] : ["library", "versions"]),
  rig: (name) => (name ? ["field", "rigs", name] : ["field", "new"]),
  pair: (left, right) => (right ? ["field", "pairs", left, right] : ["field"]),
  scene: (...what) => ["field", "scene", ...what],
  lens: () => ["lenses", "board"],
  capture: (camera) => ["lenses", "board", camera],
  straight: () => ["lenses", "edges"],
  rolls: (camera) => ["lenses", "ball", camera],
  jobs: () => ["system", "jobs"],
  settings: () => ["system", "server"],
};

/** What a place, or a camera, shows first. @type {Record<string, string[]>} */
const FIRST = {
  "field/rigs": ["field"],
  "field/pairs": ["field"],
  "field/fields": ["field"],
  "library/fields": ["field"],
  library: ["library", "images"],
  system: ["system", "publishing"],
};

/**
 * Return the words of the present address that a former one leads to, or null where it is none.
 * @param {string[]} words of the address, decoded
 * @returns {string[] | null}
 */
export function redirected(words) {
  const [first = "", ...rest] = words;
  if (first === "cameras" && rest.length === 1 && rest[0] !== "new") return [...words, "live"];
  if (words.join("/") in FIRST) return FIRST[words.join("/")];
  if (first === "calibrate")
    return rest.length === 1 || rest[1] in FORMER_STEPS ? calibrate(rest[0], rest[1]) : null;
  if (first === "library" && ["fields", "new-field"].includes(rest[0])) return ["field", ...rest];
  if (first in FORMER) return FORMER[first](...rest).filter(Boolean);
  return /^[0-9a-f]+$/.test(first) ? calibrate(first, rest[0]) : null;
}

/** @param {string} picture @param {string} [step] */
function calibrate(picture, step = "field") {
  return ["calibrate", picture, STEPS.has(step) ? step : (FORMER_STEPS[step] ?? "field")];
}
