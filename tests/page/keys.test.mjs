// Keys: of several actions with one key the first that can be done has it; letters can be switched off; controls keep theirs.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import "./window.mjs";
import { registerActions } from "../../static/core/actions.js";
import { keyLabel, keyOf, lettersOn, startKeys, switchLetters } from "../../static/core/keys.js";

const done = [];
let canUndoDetection = false,
  dialog = null;
const action = (id, keys, enabled = () => true) => ({
  id,
  label: id,
  keys,
  enabled,
  run: () => done.push(id),
});
const UNDO_DETECTION = action("undo-detection", ["ctrl+z"], () => canUndoDetection),
  UNDO = action("undo", ["ctrl+z"]),
  ACTIONS = [
    UNDO_DETECTION,
    UNDO,
    action("add", ["a"]),
    action("help", ["?"]),
    action("nudge", ["shift+ArrowUp"]),
    action("redo", ["ctrl+shift+z"]),
    action("save", ["ctrl+s"]),
    action("next", ["Enter"]),
    action("leave", ["Escape"]),
    action("hold", [" "]),
  ];
registerActions(ACTIONS);
document.querySelector = () => dialog;
startKeys();

/** A key as a browser tells it; on: the selectors that the focused element matches. */
function press(key, { on = [], ...held } = {}) {
  const event = new Event("keydown", { cancelable: true });
  const target = { matches: (selectors) => selectors.split(", ").some((one) => on.includes(one)) };
  Object.assign(event, {
    key,
    altKey: false,
    ctrlKey: false,
    metaKey: false,
    shiftKey: false,
    ...held,
  });
  Object.defineProperty(event, "target", { value: target });
  dispatchEvent(event);
  return [done.splice(0).join(), event.defaultPrevented];
}

beforeEach(() => {
  canUndoDetection = false;
  dialog = null;
  switchLetters(true);
});

test("a key runs its action and is the page's alone, one that means nothing is left to the browser", () => {
  assert.deepEqual(press("a"), ["add", true]);
  assert.deepEqual(press("A"), ["add", true]);
  assert.deepEqual(press("?", { shiftKey: true }), ["help", true]);
  assert.deepEqual(press("ArrowUp", { shiftKey: true }), ["nudge", true]);
  assert.deepEqual(
    [press("z"), press("ArrowUp"), press("a", { altKey: true })],
    [
      ["", false],
      ["", false],
      ["", false],
    ],
  );
});

test("control and command are one, with shift it is another key", () => {
  assert.deepEqual(
    [press("z", { ctrlKey: true }), press("z", { metaKey: true })],
    [
      ["undo", true],
      ["undo", true],
    ],
  );
  assert.deepEqual(press("Z", { ctrlKey: true, shiftKey: true }), ["redo", true]);
});

test("of several actions with one key the first that can be done has it, and only that one names it", () => {
  assert.deepEqual([keyOf(UNDO), keyOf(UNDO_DETECTION)], ["ctrl+z", undefined]);
  canUndoDetection = true;
  assert.equal(press("z", { ctrlKey: true })[0], "undo-detection");
  assert.deepEqual([keyOf(UNDO), keyOf(UNDO_DETECTION)], [undefined, "ctrl+z"]);
});

test("who types into a field types, but leaves it by Escape and saves by control and S", () => {
  const on = ["input"];
  assert.deepEqual(
    [press("a", { on }), press("z", { on, ctrlKey: true }), press("Enter", { on })],
    [
      ["", false],
      ["", false],
      ["", false],
    ],
  );
  assert.deepEqual(
    [press("Escape", { on })[0], press("s", { on, ctrlKey: true })[0]],
    ["leave", "save"],
  );
});

test("a button in focus keeps Enter and the space bar, and no other key", () => {
  const on = ["button"];
  assert.deepEqual(
    [press("Enter", { on }), press(" ", { on }), press("a", { on })],
    [
      ["", false],
      ["", false],
      ["add", true],
    ],
  );
});

test("keys of one letter are switched off and stay off in this browser, the others remain", () => {
  switchLetters(false);
  assert.deepEqual([press("a")[0], press("?", { shiftKey: true })[0]], ["", ""]);
  assert.deepEqual(
    [press("Enter")[0], press(" ")[0], press("z", { ctrlKey: true })[0]],
    ["next", "hold", "undo"],
  );
  assert.equal(localStorage.getItem("touchline.letters"), "off");
  switchLetters(true);
  assert.deepEqual([lettersOn.value, press("a")[0]], [true, "add"]);
});

test("before a dialog the page's keys mean nothing", () => {
  dialog = {};
  assert.deepEqual(
    [press("a"), press("Escape")],
    [
      ["", false],
      ["", false],
    ],
  );
});

test("a key is printed as it stands on a keyboard", () => {
  assert.deepEqual(["ctrl+z", "+", "shift+ArrowUp", "F2"].map(keyLabel), [
    "Ctrl Z",
    "+",
    "Shift ↑",
    "F2",
  ]);
});
