// Mouse, pen and fingers on a stage: which tool gets them, and what two fingers, the wheel and the space bar mean.
import { editing, pointer, tool } from "../../core/state.js";
import { pick } from "./pick.js";
import { panBy, toPicture, zoomBy } from "../viewport.js";
import { isOverCorrected } from "../../features/compare/comparison.js";

/** @typedef {{ x: number, y: number, touch: boolean, down: boolean }} Pointed picture pixels
 * @typedef {object} Ground what a stage lies on: its tool, its view, and who is told where the pointer is
 * @property {{ down: (at: import("./pick.js").At) => void, move: (at: import("./pick.js").At) => void, up: () => void,
 * cancel: () => void }} pick
 * @property {(sx: number, sy: number) => boolean} isPicking @property {typeof panBy} panBy @property {typeof zoomBy}
 * zoomBy @property {typeof toPicture} toPicture
 * @property {(at: Pointed | null, sx?: number, sy?: number) => void} point */

/** @type {Ground} */
const MAIN = {
  pick,
  isPicking: (sx, sy) => editing.value && tool.value !== "pan" && !isOverCorrected(sx, sy),
  panBy,
  zoomBy,
  toPicture,
  point: (at, sx = 0, sy = 0) => {
    pointer.value = editing.value && !at?.down && isOverCorrected(sx, sy) ? null : at;
  },
};

const WHEEL = 0.0016; // zoom per wheel unit: one notch of 100 is 17 %
const MIDDLE = 1;

/** @param {HTMLElement} stage @param {Ground} [ground] @returns {() => void} takes the listeners off */
export function listen(stage, ground = MAIN) {
  /** @type {Map<number, { x: number, y: number }>} */
  const fingers = new Map();
  let doing = /** @type {"" | "pick" | "pan" | "pinch"} */ ("");
  let space = false;

  /** @param {PointerEvent | WheelEvent} e */
  const at = (e) => {
    const { left, top } = stage.getBoundingClientRect();
    return {
      x: e.clientX - left,
      y: e.clientY - top,
      touch: "pointerType" in e && e.pointerType === "touch",
      shift: e.shiftKey,
      ctrl: e.ctrlKey || e.metaKey,
      alt: e.altKey,
    };
  };

  /** @param {PointerEvent} e */
  const note = (e) => {
    const p = at(e),
      [x, y] = ground.toPicture(p.x, p.y);
    ground.point({ x, y, touch: p.touch, down: doing === "pick" }, p.x, p.y);
  };

  /** @param {PointerEvent} e */
  function down(e) {
    if (/** @type {Element} */ (e.target).closest("[data-off-stage]")) return;
    stage.focus({ preventScroll: true });
    capture(e.pointerId);
    const p = at(e);
    fingers.set(e.pointerId, p);
    if (fingers.size === 2) {
      if (doing === "pick") ground.pick.cancel();
      doing = "pinch";
    } else if (fingers.size === 1) {
      doing =
        e.button === MIDDLE || space || !ground.isPicking(p.x, p.y)
          ? "pan"
          : e.button === 0
            ? "pick"
            : "";
      if (doing === "pick") ground.pick.down(p);
    }
    note(e);
  }

  /** @param {PointerEvent} e */
  function move(e) {
    const before = fingers.get(e.pointerId),
      p = at(e);
    if (before && doing === "pan") ground.panBy(p.x - before.x, p.y - before.y);
    if (before && doing === "pinch" && fingers.size === 2) pinch(e.pointerId, before, p);
    if (before) fingers.set(e.pointerId, p);
    if (before && doing === "pick") ground.pick.move(p);
    note(e);
  }

  /**
   * Two fingers hold two places of the picture: they move with them.
   * @param {number} id
   * @param {{ x: number, y: number }} before
   * @param {{ x: number, y: number }} now
   */
  function pinch(id, before, now) {
    const other = [...fingers].find(([finger]) => finger !== id)?.[1];
    if (!other) return;
    const was = Math.hypot(before.x - other.x, before.y - other.y),
      is = Math.hypot(now.x - other.x, now.y - other.y);
    ground.panBy((now.x - before.x) / 2, (now.y - before.y) / 2);
    if (was > 1) ground.zoomBy(is / was, (now.x + other.x) / 2, (now.y + other.y) / 2);
  }

  /** @param {PointerEvent} e */
  function up(e) {
    if (!fingers.delete(e.pointerId)) return;
    if (doing === "pick") ground.pick.up();
    if (doing !== "pinch" || fingers.size === 0) doing = "";
    note(e);
    if (e.pointerType === "touch" && fingers.size === 0) ground.point(null);
  }

  /** @param {PointerEvent} e */
  function lost(e) {
    if (!fingers.delete(e.pointerId)) return;
    if (doing === "pick") ground.pick.cancel();
    if (fingers.size === 0) doing = "";
    ground.point(null);
  }

  /** @param {number} id */
  function capture(id) {
    try {
      stage.setPointerCapture(id);
    } catch {
      /* the pointer has gone already */
    }
  }

  /** @param {WheelEvent} e */
  function wheel(e) {
    if (/** @type {Element} */ (e.target).closest("[data-off-stage]")) return;
    e.preventDefault();
    const p = at(e),
      lines = e.deltaMode === WheelEvent.DOM_DELTA_LINE ? 33 : 1;
    ground.zoomBy(Math.exp(-e.deltaY * lines * WHEEL), p.x, p.y);
  }

  const leave = () => {
    if (fingers.size === 0) ground.point(null);
  };
  const noMenu = (/** @type {Event} */ e) => {
    if (fingers.size) e.preventDefault();
  }; // a long press is a press
  const isBar = (/** @type {KeyboardEvent} */ e) =>
    e.key === " " &&
    !(
      /** @type {Element} */ (e.target).closest("button, input, select, textarea, a, [role=button]")
    );
  const barDown = (/** @type {KeyboardEvent} */ e) => {
    if (isBar(e)) {
      space = true;
      stage.dataset.space = "";
      e.preventDefault();
    }
  };
  const barUp = (/** @type {KeyboardEvent} */ e) => {
    if (e.key === " ") {
      space = false;
      delete stage.dataset.space;
    }
  };
  const escape = (/** @type {KeyboardEvent} */ e) => {
    if (e.key === "Escape" && doing === "pick") {
      ground.pick.cancel();
      doing = "";
      e.preventDefault();
    }
  };

  /** @type {[EventTarget, string, any, AddEventListenerOptions?][]} */
  const all = [
    [stage, "pointerdown", down],
    [stage, "pointermove", move],
    [stage, "pointerup", up],
    [stage, "pointercancel", lost],
    [stage, "pointerleave", leave],
    [stage, "contextmenu", noMenu],
    [stage, "wheel", wheel, { passive: false }],
    [window, "keydown", barDown],
    [window, "keyup", barUp],
    [window, "keydown", escape, { capture: true }],
  ];
  for (const [target, type, listener, options] of all)
    target.addEventListener(type, listener, options);
  return () => {
    for (const [target, type, listener, options] of all)
      target.removeEventListener(type, listener, options);
  };
}
