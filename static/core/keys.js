// Keyboard: one listener that looks the key up in the table of actions.
import { ACTIONS, run } from "./actions.js";
import { preference } from "./preference.js";
import { t } from "./words.js";

/**
 * Actions by their key: one may mean different things where different things can be done.
 * @type {Map<string, import("./actions.js").Action[]>}
 */
const BY_KEY = new Map();

/** "ctrl+shift+z", "?", "ArrowUp": as the table writes it. @param {KeyboardEvent} event */
function nameOf(event) {
  const ctrl = event.ctrlKey || event.metaKey ? "ctrl+" : "";
  if (event.key.length > 1) return ctrl + (event.shiftKey ? "shift+" : "") + event.key;
  return ctrl + (ctrl && event.shiftKey ? "shift+" : "") + event.key.toLowerCase(); // "?" already says shift
}

/** Keys that a focused control wants for itself. @param {KeyboardEvent} event */
function belongsToControl(event) {
  const target = /** @type {Element} */ (event.target);
  if (target.matches("input, textarea, select"))
    return (
      event.key !== "Escape" &&
      !((event.ctrlKey || event.metaKey) && ["s", "k"].includes(event.key))
    );
  return (
    target.matches("button, a, summary, [role=button], [role=slider]") &&
    ["Enter", " "].includes(event.key)
  );
}

/** The key that means an action now, where another one that can be done has the same. @param
 * {import("./actions.js").Action} action */
export const keyOf = (action) =>
  action.keys?.find((key) => {
    const first = BY_KEY.get(key)?.find((one) => one.enabled?.() ?? true);
    return !first || first === action;
  });

/** Whether keys of one character do something: who speaks to the machine, or presses keys unmeant, wants them off
 * (WCAG 2.1, 2.1.4). */
export const lettersOn = preference("touchline.letters");

/** @param {boolean} isOn */
export const switchLetters = (isOn) => {
  lettersOn.value = isOn;
};

/** One character alone, but the space bar, which presses what has the focus. @param {string} name */
const isLetter = (name) => name.length === 1 && name !== " ";

export function startKeys() {
  for (const action of ACTIONS.values())
    for (const key of action.keys ?? []) BY_KEY.set(key, [...(BY_KEY.get(key) ?? []), action]);
  addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.altKey || belongsToControl(event)) return;
    if (document.querySelector("dialog[open]")) return; // its own keys are the browser's
    const name = nameOf(event);
    if (isLetter(name) && !lettersOn.value) return;
    const action = BY_KEY.get(name)?.find((one) => one.enabled?.() ?? true);
    if (!action) return;
    event.preventDefault();
    run(action.id, event);
  });
}

const SHOWN = {
  ArrowLeft: "←",
  ArrowRight: "→",
  ArrowUp: "↑",
  ArrowDown: "↓",
  ctrl: t("core.keys.ctrl"),
  shift: t("core.keys.shift"),
  Delete: t("core.keys.delete"),
  Escape: t("core.keys.escape"),
  " ": t("core.keys.space"),
};

/** A key as the page prints it: "Ctrl Z". @param {string} key */
export const keyLabel = (key) =>
  (key === "+" ? ["+"] : key.split("+"))
    .map(
      (part) =>
        SHOWN[/** @type {keyof typeof SHOWN} */ (part)] ??
        (part.length === 1 ? part.toUpperCase() : part),
    )
    .join(" ");
