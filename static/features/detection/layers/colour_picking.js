// Picks colour samples on a picture, points or boxes, by pointer, finger or keyboard.
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { colour, teach, colourName } from "../colours.js";

/** @typedef {import("../../../core/types").Point} Point */

const MIN_BOX = 6; // screen px that a pointer must have moved; less is a click
const FAR_PX = 10;
/** @type {Record<string, Point>} */
const WAYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** @param {{ width: number, height: number }} props raw px */
export function ColourPicking({ width, height }) {
  const [from, setFrom] = useState(/** @type {{ at: Point, screen: Point } | null} */ (null));
  const [to, setTo] = useState(/** @type {Point | null} */ (null));
  const [cross, setCross] = useState(
    /** @type {Point} */ ([Math.round(width / 2), Math.round(height / 2)]),
  );
  const [corner, setCorner] = useState(/** @type {Point | null} */ (null));
  const [isByKeys, setByKeys] = useState(false),
    mark = useRef(/** @type {Element | null} */ (null));
  useEffect(() => {
    if (isByKeys) mark.current?.scrollIntoView({ block: "nearest", inline: "nearest" });
  }, [isByKeys, cross]);

  /** @param {PointerEvent} e @returns {Point} */
  const under = (e) => {
    const box = /** @type {Element} */ (e.currentTarget).getBoundingClientRect();
    const at = (/** @type {number} */ s, /** @type {number} */ all) =>
      Math.round(10 * Math.min(all - 1, Math.max(0, s * all - 0.5))) / 10;
    return [
      at((e.clientX - box.left) / box.width, width),
      at((e.clientY - box.top) / box.height, height),
    ];
  };
  /** @param {Point} a @param {Point} b @returns {[number, number, number, number]} */
  const boxOf = (a, b) => [
    Math.min(a[0], b[0]),
    Math.min(a[1], b[1]),
    Math.max(a[0], b[0]),
    Math.max(a[1], b[1]),
  ];
  const on = {
    onPointerDown: (/** @type {PointerEvent} */ e) => {
      if (e.button) return;
      /** @type {Element} */ (e.currentTarget).setPointerCapture(e.pointerId);
      setByKeys(false);
      setCorner(null);
      setFrom({ at: under(e), screen: [e.clientX, e.clientY] });
      setTo(null);
    },
    onPointerMove: (/** @type {PointerEvent} */ e) => {
      if (from && Math.hypot(e.clientX - from.screen[0], e.clientY - from.screen[1]) >= MIN_BOX)
        setTo(under(e));
    },
    onPointerUp: () => {
      if (!from) return;
      teach(to ? boxOf(from.at, to) : from.at);
      setCross(to ?? from.at);
      setFrom(null);
      setTo(null);
    },
    onPointerCancel: () => {
      setFrom(null);
      setTo(null);
    }, // two fingers: the page is being moved
    onKeyDown: (/** @type {KeyboardEvent} */ e) => {
      const way = WAYS[e.key];
      if (e.ctrlKey || e.metaKey || e.altKey || !(way || e.key === "Enter" || e.key === "b"))
        return;
      e.preventDefault();
      setByKeys(true);
      if (way) {
        const far = e.shiftKey ? FAR_PX : 1;
        setCross([
          Math.min(width - 1, Math.max(0, cross[0] + far * way[0])),
          Math.min(height - 1, Math.max(0, cross[1] + far * way[1])),
        ]);
        return;
      }
      if (e.key === "b") {
        setCorner(corner ? null : cross);
        return;
      }
      teach(corner ? boxOf(corner, cross) : cross);
      setCorner(null);
    },
  };
  const a = from?.at ?? corner,
    b = from ? to : corner && cross,
    drawn = a && b && boxOf(a, b),
    arm = width / 60;
  return html`<svg
    class="over picking"
    viewBox=${`-0.5 -0.5 ${width} ${height}`}
    tabindex="0"
    role="application"
    data-testid="picking"
    ...${on}
    aria-label=${t("detection.picking", {
      colour: colourName(colour.value),
      x: Math.round(cross[0]),
      y: Math.round(cross[1]),
    })}
  >
    ${
      drawn &&
      html`
      <rect
        class="casing"
        x=${drawn[0]}
        y=${drawn[1]}
        width=${drawn[2] - drawn[0]}
        height=${drawn[3] - drawn[1]}
      />
      <rect x=${drawn[0]} y=${drawn[1]} width=${drawn[2] - drawn[0]} height=${drawn[3] - drawn[1]} />
    `
    }
    ${
      isByKeys &&
      ["casing", ""].map(
        (kind) => html`<path
        key=${kind}
        ref=${mark}
        class=${kind}
        d=${`M${cross[0] - arm} ${cross[1]}h${2 * arm}M${cross[0]} ${cross[1] - arm}v${2 * arm}`}
      />`,
      )
    }
  </svg>`;
}
