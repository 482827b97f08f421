// Raw and corrected alternating on one spot, by timer or while a key is held.
import { computed, effect, signal, untracked } from "@preact/signals";

/** Swaps a second: far below the three flashes a second that can harm. */
export const RATES = [0.5, 1, 2];

/** showing: the one that is seen now. rate: swaps a second, when it goes by itself. */
export const blink = signal(
  /** @type {{ showing: "raw" | "corrected", running: boolean, rate: number }} */ ({
    showing: "raw",
    running: true,
    rate: 1,
  }),
);
/** While it is held, the other picture is seen. */
export const isFlipped = signal(false);

const wish = matchMedia("(prefers-reduced-motion: reduce)");
/** Whether the operator's system asks for less motion: then nothing swaps by itself. */
export const prefersLessMotion = signal(wish.matches);
wish.addEventListener("change", () => {
  prefersLessMotion.value = wish.matches;
});

export const swap = () => {
  blink.value = { ...blink.value, showing: blink.value.showing === "raw" ? "corrected" : "raw" };
};
export const pause = () => {
  blink.value = { ...blink.value, running: !blink.value.running };
};
/** @param {number} rate */
export const setSwapRate = (rate) => {
  blink.value = { ...blink.value, rate, running: true };
};

/** What is seen of a way to compare: blinking is one of the two pictures, and a held key turns them over.
 * @param {import("../../core/types").CompareMode} mode */
export function pictureShownIn(mode) {
  const at = mode === "blink" ? blink.value.showing : mode;
  if (!isFlipped.value || at === "side" || at === "wipe") return at;
  return at === "raw" ? "corrected" : "raw";
}

/** Show the other one until the key or the finger is lifted. @param {KeyboardEvent | PointerEvent} [event] */
export function hold(event) {
  if (isFlipped.value) return; // a held key repeats
  isFlipped.value = true;
  const ends =
    event?.type === "keydown" ? ["keyup", "blur"] : ["pointerup", "pointercancel", "blur"];
  const end = () => {
    isFlipped.value = false;
    for (const type of ends) removeEventListener(type, end);
  };
  for (const type of ends) addEventListener(type, end);
}

const goes = computed(() =>
  blink.value.running && !prefersLessMotion.value && !isFlipped.value ? blink.value.rate : 0,
);

/** Swap by itself while somebody looks, from now on. @param {() => boolean} isOn whether the pictures are to blink */
export function startBlinking(isOn) {
  effect(() => {
    const rate = isOn() ? goes.value : 0;
    if (!rate) return;
    const timer = setInterval(() => {
      if (!document.hidden) untracked(swap);
    }, 1000 / rate);
    return () => clearInterval(timer);
  });
}
