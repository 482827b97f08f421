// Addresses of former versions: two images that were compared. They lead to the desk of their cameras' rig, which is
// made where there is none.
import { effect, untracked } from "@preact/signals";
import { call, request } from "../../core/api.js";
import { goInstead, route } from "../../core/route.js";
import { cameras, listed, notify, notifyError } from "../../core/state.js";
import { t } from "../../core/words.js";
import { keep, keyOf, matchesIn } from "./kept_matches.js";
import { loadRigs, rigs } from "./rig.js";

/** @typedef {import("../../core/types").Camera} Camera */

const MOST = 64; // characters of a rig's name

export function startFormerPairs() {
  effect(() => {
    const { view, left, right } = route.value;
    if (view === "former-pair" && listed.value) untracked(() => void lead(left, right));
  });
}

/** @param {string} left @param {string} right ids of images */
async function lead(left, right) {
  const isHere = () => route.value.left === left && route.value.right === right;
  try {
    const [a, b] = await Promise.all(
      [left, right].map(async (id) => {
        const { camera } = await call("GET", `/snapshots/${encodeURIComponent(id)}`);
        return cameras.value.find((c) => c.id === camera) ?? null;
      }),
    );
    if (!isHere()) return;
    const why =
      !a || !b
        ? "no-camera"
        : a === b
          ? "one-camera"
          : a.field && a.field === b.field
            ? ""
            : "no-field";
    if (!a || !b || why) {
      goInstead("field");
      if (why)
        notify({
          level: "warn",
          text: t(`rig.former.${why}`),
          fix: t(`rig.former.${why}.fix`),
          about: "pictures",
        });
      return;
    }
    const { name, cameras: members } = await rigOf(a, b),
      [first, second] = members.map((c) => c.camera),
      pictures = first === a.id ? { a: left, b: right } : { a: right, b: left };
    keep(keyOf(name, first, second), { pictures, matches: matchesIn(pictures.a, pictures.b) });
    if (isHere()) goInstead("match", { rig: name, left: first, right: second });
  } catch (error) {
    if (isHere()) goInstead("field");
    notifyError(error);
  }
}

/** The rig of exactly these two; made where there is none. @param {Camera} a @param {Camera} b */
async function rigOf(a, b) {
  await loadRigs();
  const there = rigs.value.find(
    ({ cameras: all }) =>
      all.length === 2 && all.every((c) => c.camera === a.id || c.camera === b.id),
  );
  if (there) return there;
  const json = {
    title: `${a.name} – ${b.name}`.slice(0, 100),
    field: a.field,
    cameras: [a, b].map(({ id, region }) => ({ camera: id, region })),
  };
  const made = await request("PUT", `/rigs/${freeName(`${a.id}-${b.id}`)}`, { json });
  await loadRigs();
  return /** @type {import("./types").Rig} */ (await made.json());
}

/** @param {string} base */
function freeName(base) {
  for (let n = 1; ; n++) {
    const end = n === 1 ? "" : `-${n}`,
      name = base.replace(/[^A-Za-z0-9_-]/g, "-").slice(0, MOST - end.length) + end;
    if (!rigs.value.some((r) => r.name === name)) return name;
  }
}
