// The wall: whether the field's lines are drawn over its pictures, and in which order its cameras stand.
import { computed, effect, signal } from "@preact/signals";
import { preference } from "../../core/preference.js";
import { cameras } from "../../core/state.js";
import { problems } from "../shell/problems.js";

/** Each frame of a stream has the lines with it: nothing more is asked for. */
export const wallLines = preference("touchline-wall-lines");

export const toggleWallLines = () => {
  wallLines.value = !wallLines.value;
};

/** Whether the operator's pointer or focus is in the wall: nothing moves then. */
export const isWallHeld = signal(false);

/** What is worst of a camera, and stops a match. @param {string} id */
export const troubleOf = (id) =>
  problems.value.find((it) => it.camera === id && it.level === "bad") ?? null;

/**
 * The ids in a new order: those in trouble first, else as they are listed. While it is held, all stay where they were.
 * @param {string[]} ids as they are listed
 * @param {Set<string>} troubled
 * @param {string[]} before
 * @param {boolean} isHeld
 */
export function wallOrder(ids, troubled, before, isHeld) {
  if (!isHeld) return ids.toSorted((a, b) => Number(troubled.has(b)) - Number(troubled.has(a)));
  const known = before.filter((id) => ids.includes(id));
  return [...known, ...ids.filter((id) => !known.includes(id))];
}

const troubled = computed(() =>
  cameras.value
    .map(({ id }) => id)
    .filter((id) => troubleOf(id))
    .join("\n"),
);
const order = signal(/** @type {string[]} */ ([]));
effect(() => {
  const now = wallOrder(
    cameras.value.map(({ id }) => id),
    new Set(troubled.value.split("\n")),
    order.peek(),
    isWallHeld.value,
  );
  if (now.join("\n") !== order.peek().join("\n")) order.value = now;
});

/** The cameras as they stand on the wall. */
export const wallCameras = computed(() =>
  order.value.flatMap((id) => cameras.value.filter((camera) => camera.id === id)),
);
