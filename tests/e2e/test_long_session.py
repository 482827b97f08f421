"""A long session of edits: undone to the beginning and redone to the end, every document is the same as before."""

import pytest

from tests.support.held_requests import holding, wait_until_held
from tests.support.tiers import long
from tests.support.waiting import until

# Edits as the tools make them, chosen by a small generator with a seed; after each the document as text.
EDIT = """async ([seed, count]) => {
  const page = await import("/core/document.js");
  const { BORDERS, change, doc, past, pointsOf, undo, redo, future, load, withPoints } = page;
  const { showWhileDragging, endDrag } = page;
  load(doc.value);  // choosing the field was a change as well
  const { nudge, remove, withAdded, withMoved } = await import("/features/calibrate/editing.js");
  const { selection } = await import("/core/state.js");
  let state = seed;
  const random = () => { state = (state * 1664525 + 1013904223) % 4294967296; return state / 4294967296; };
  const one = (list) => list[Math.floor(random() * list.length)];
  const features = [...BORDERS, "halfway-line"];
  const anyPick = () => {
    const feature = one(features), { length } = pointsOf(doc.value, feature);
    return length ? { feature, index: Math.floor(random() * length) } : null;
  };
  const edits = [
    () => change(withAdded(doc.value, one(features), 640 * random(), 480 * random()).next),
    () => change(withAdded(doc.value, one(features), 640 * random(), 480 * random()).next),
    () => { const pick = anyPick(); if (pick) { selection.value = [pick]; nudge(random() - 0.5, random() - 0.5); } },
    () => { const pick = anyPick(); if (pick) remove([pick]); },
    () => { const pick = anyPick(), before = doc.value; if (!pick) return;
      for (let i = 1; i < 5; i++) showWhileDragging(withMoved(before, [pick], i * random(), i)); endDrag(before); },
    () => { const feature = one(features), whole = pointsOf(doc.value, feature).map(([x, y]) => [Math.round(x), y]);
      change(withPoints(doc.value, feature, whole, "line")); },
    () => change({ ...doc.value, options: { ...doc.value.options, degree: 1 + Math.floor(8 * random()) } }),
    () => change({ ...doc.value, rotate: one([0, 90, 180, 270]) }),
  ];
  const texts = [JSON.stringify(doc.value)];
  for (let tries = 0; texts.length <= count && tries < 20 * count; tries++) {
    one(edits)();
    const text = JSON.stringify(doc.value);
    if (text !== texts.at(-1)) texts.push(text);
  }
  const steps = texts.length - 1, wrong = [];
  if (past.value.length !== steps) wrong.push(`${past.value.length} kept of ${steps}`);
  for (let i = steps - 1; i >= 0; i--) { undo(); if (JSON.stringify(doc.value) !== texts[i]) wrong.push(`undo ${i}`); }
  if (past.value.length) wrong.push("something before the beginning");
  undo();
  for (let i = 1; i <= steps; i++) { redo(); if (JSON.stringify(doc.value) !== texts[i]) wrong.push(`redo ${i}`); }
  if (future.value.length) wrong.push("something after the end");
  return { steps, wrong, last: JSON.parse(texts.at(-1)) };
}"""


@pytest.mark.parametrize(("seed", "edits"), [(1, 60), *(long(seed, 1000) for seed in (1, 20081))])
def test_a_thousand_edits_undone_and_redone_give_identical_documents(arriving, straight_picture, seed, edits):
    operator = arriving.visit(modules=True).open(straight_picture, "table", "full")
    done = operator.page.evaluate(EDIT, [seed, edits])
    assert done["steps"] == edits
    assert done["wrong"] == []
    clicked = {o["feature"]: o["points"] for o in done["last"]["observations"]}
    until(lambda: {o["feature"]: o["points"] for o in operator.draft()["observations"]},
               lambda kept: kept == clicked)


def test_what_is_taken_back_while_it_is_being_saved_is_taken_back_on_the_server_too(operator, straight_picture):
    page = operator.open(straight_picture, "table", "full").click("left", [(80, 100)]).page
    before = operator.draft()["observations"]
    with holding(page, "**/api/v1/drafts/*", "PUT") as saves:
        operator.click("left", [(80, 200)])
        wait_until_held(page, saves)
        page.keyboard.press("Control+z")
    until(lambda: operator.draft()["observations"], lambda kept: kept == before)
    page.reload()
    operator.wait_for_picture()
    assert operator.draft()["observations"] == before
