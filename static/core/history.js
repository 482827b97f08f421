// A document with a history: undo is an earlier copy. A drag is shown while it lasts and becomes one change at its end.
import { batch, signal } from "@preact/signals";

const MAX_HISTORY = 5000; // a copy shares all with the one before it but the line that was changed

/** @param {unknown} a @param {unknown} b */
export const isEqual = (a, b) => a === b || JSON.stringify(a) === JSON.stringify(b);

/** @template T @param {T} first */
export function createHistory(first) {
  const doc = signal(first);
  const past = signal(/** @type {T[]} */ ([]));
  const future = signal(/** @type {T[]} */ ([]));
  /** True while a point is held: what is asked and kept waits for its release. */
  const dragging = signal(false);

  /** One change that can be undone. @param {T} next */
  function change(next) {
    if (isEqual(next, doc.value)) return;
    past.value = [...past.value.slice(-MAX_HISTORY), doc.value];
    future.value = [];
    doc.value = next;
  }

  /** Show the document as it will be once a drag ends. @param {T} next */
  function showWhileDragging(next) {
    dragging.value = true;
    doc.value = next;
  }

  /** End of a drag: all of it becomes one change. @param {T} before */
  function endDrag(before) {
    const after = doc.value;
    batch(() => {
      // nobody sees the document jump back for a moment
      doc.value = before;
      change(after);
      dragging.value = false;
    });
  }

  /** Forget a drag. @param {T} before */
  function cancelDrag(before) {
    doc.value = before;
    dragging.value = false;
  }

  function undo() {
    const before = past.value.at(-1);
    if (before === undefined) return;
    future.value = [doc.value, ...future.value];
    past.value = past.value.slice(0, -1);
    doc.value = before;
  }

  function redo() {
    const [after, ...rest] = future.value;
    if (after === undefined) return;
    past.value = [...past.value, doc.value];
    future.value = rest;
    doc.value = after;
  }

  /** Start afresh, without history. @param {T} next */
  function load(next) {
    past.value = [];
    future.value = [];
    dragging.value = false;
    doc.value = next;
  }

  return {
    doc,
    past,
    future,
    dragging,
    change,
    showWhileDragging,
    endDrag,
    cancelDrag,
    undo,
    redo,
    load,
  };
}
