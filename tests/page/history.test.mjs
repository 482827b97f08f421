// The history of a document: undone to the beginning and redone to the end, every document is the same as before.
import assert from "node:assert/strict";
import { test } from "node:test";
import { createHistory } from "../../static/core/history.js";
import * as core from "../../static/core/document.js";
import { selection, snapshot } from "../../static/core/state.js";
import { nudge, remove, withAdded, withMoved } from "../../static/features/calibrate/editing.js";

const {
  BORDERS,
  change,
  doc,
  endDrag,
  future,
  past,
  pointsOf,
  redo,
  showWhileDragging,
  undo,
  withPoints,
} = core;

/** Numbers between 0 and 1 that are the same for the same seed. */
function generator(seed) {
  let state = seed;
  return () => {
    state = (state * 1664525 + 1013904223) % 4294967296;
    return state / 4294967296;
  };
}

/** So many edits as the tools make them; the document as text before the first and after each. */
function edited(seed, count) {
  const random = generator(seed),
    one = (list) => list[Math.floor(random() * list.length)],
    features = [...BORDERS, "halfway-line"],
    add = () => change(withAdded(doc.value, one(features), 640 * random(), 480 * random()).next);
  const anyPick = () => {
    const feature = one(features),
      { length } = pointsOf(doc.value, feature);
    return length ? { feature, index: Math.floor(random() * length) } : null;
  };
  /** With a point that is there, if there is one. */
  const withPick = (edit) => () => {
    const pick = anyPick();
    if (pick) edit(pick);
  };
  const edits = [
    add,
    add,
    withPick((pick) => {
      selection.value = [pick];
      nudge(random() - 0.5, random() - 0.5);
    }),
    withPick((pick) => remove([pick])),
    withPick((pick) => {
      const before = doc.value;
      for (let i = 1; i < 5; i++) showWhileDragging(withMoved(before, [pick], i * random(), i));
      endDrag(before);
    }),
    () => {
      const feature = one(features);
      change(
        withPoints(
          doc.value,
          feature,
          pointsOf(doc.value, feature).map(([x, y]) => [Math.round(x), y]),
          "line",
        ),
      );
    },
    () =>
      change({
        ...doc.value,
        options: { ...doc.value.options, degree: 1 + Math.floor(8 * random()) },
      }),
    () => change({ ...doc.value, rotate: one([0, 90, 180, 270]) }),
  ];
  const texts = [JSON.stringify(doc.value)];
  while (texts.length <= count) {
    one(edits)();
    const text = JSON.stringify(doc.value);
    if (text !== texts.at(-1)) texts.push(text);
  }
  return texts;
}

for (const [seed, count] of [
  [1, 1000],
  [20081, 1000],
])
  test(`a thousand edits are undone and redone to identical documents (seed ${seed})`, () => {
    snapshot.value = { id: "a", width: 640, height: 480 };
    core.load(core.EMPTY);
    const texts = edited(seed, count);
    assert.equal(past.value.length, count);
    for (const text of texts.slice(0, -1).toReversed()) {
      undo();
      assert.equal(JSON.stringify(doc.value), text);
    }
    assert.equal(past.value.length, 0);
    undo(); // nothing is before the beginning
    assert.equal(JSON.stringify(doc.value), texts[0]);
    for (const text of texts.slice(1)) {
      redo();
      assert.equal(JSON.stringify(doc.value), text);
    }
    redo();
    assert.equal(future.value.length, 0);
    assert.equal(JSON.stringify(doc.value), texts.at(-1));
  });

test("a drag is one change, and none where everything is back where it was", () => {
  const history = createHistory({ x: 0 });
  for (const x of [1, 2, 3]) history.showWhileDragging({ x });
  assert.equal(history.dragging.value, true);
  assert.equal(history.past.value.length, 0);
  history.endDrag({ x: 0 });
  assert.deepEqual(
    [history.doc.value, history.past.value, history.dragging.value],
    [{ x: 3 }, [{ x: 0 }], false],
  );
  history.showWhileDragging({ x: 9 });
  history.showWhileDragging({ x: 3 });
  history.endDrag({ x: 3 });
  assert.equal(history.past.value.length, 1);
});

test("a drag that is cancelled leaves the document and its history as they were", () => {
  const history = createHistory({ x: 0 });
  history.change({ x: 1 });
  history.showWhileDragging({ x: 5 });
  history.cancelDrag({ x: 1 });
  assert.deepEqual(
    [history.doc.value, history.past.value, history.dragging.value],
    [{ x: 1 }, [{ x: 0 }], false],
  );
});

test("a change after an undo ends what could be redone, and an equal document is no change", () => {
  const history = createHistory({ x: 0 });
  history.change({ x: 1 });
  history.undo();
  history.change({ x: 0 });
  assert.equal(history.future.value.length, 1);
  history.change({ x: 2 });
  history.redo();
  assert.deepEqual([history.doc.value, history.future.value], [{ x: 2 }, []]);
});

test("another document begins without a history", () => {
  const history = createHistory({ x: 0 });
  history.change({ x: 1 });
  history.showWhileDragging({ x: 2 });
  history.load({ x: 7 });
  history.undo();
  assert.deepEqual(
    [history.doc.value, history.past.value, history.dragging.value],
    [{ x: 7 }, [], false],
  );
});
