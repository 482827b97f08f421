// Asking again and again: one question at a time, none while the page is hidden.
import { effect, untracked } from "@preact/signals";

/**
 * What asks when it starts, again after a while, and at once whenever a signal that `everyMs` reads has changed.
 * @param {() => Promise<unknown>} look a failure is let go: a silent server is told elsewhere
 * @param {() => number} everyMs how long after an answer the next question comes; 0: none, until a signal changes
 * @returns {{ start: () => void, ask: () => Promise<void> }} ask: at once
 */
export function polling(look, everyMs) {
  let timer = 0,
    isAsking = false,
    isWanted = false; // since the question that is under way was put
  const ask = async () => {
    clearTimeout(timer);
    isWanted = isAsking;
    if (isAsking) return;
    isAsking = true;
    if (!document.hidden) await look().catch(() => {});
    isAsking = false;
    const afterMs = everyMs();
    if (isWanted) void ask();
    else if (afterMs) timer = setTimeout(() => void ask(), afterMs);
  };
  const start = () => {
    effect(() => {
      if (everyMs()) untracked(() => void ask());
    });
  };
  return { start, ask };
}
