// Drawn over each image of two: numbered marks, outliers crossed, epipolar lines, and predicted places.
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { tool } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { path, placed } from "../../../canvas/drawing.js";
import { Glass, SIZE_PX } from "../../../canvas/layers/loupe.js";
import { chosen, desk, pictures, pointed, views } from "../match_desk.js";
import { epipolarLines, hoveredMatch, linedMatch, matchErrors } from "../match_lines.js";
import { chosenPoint } from "../matches.js";

/** @typedef {import("../types").Side} Side */

// Told apart by colour-blind eyes (Okabe and Ito's palette), and by their shape as well.
const MARK = "#56b4e9",
  MISTAKE = "#ff9d47",
  WAITING = "#f0e442",
  LINE = "#7fe0b0";

/** @param {{ s: Side }} props */
export function MatchOverlay({ s }) {
  const picture = pictures.value[s],
    { k, tx, ty } = views[s].view.value,
    { line, place } = epipolarLines.value[s];
  if (!picture) return null;
  return html`<svg class="overlay" aria-hidden="true">
    <clipPath id=${`in-${s}`}>
      <rect x="-.5" y="-.5" width=${picture.width} height=${picture.height} />
    </clipPath>
    ${
      line &&
      html`<g clip-path=${`url(#in-${s})`} transform=${placed(tx, ty, k)}>
      <g class="epipolar" data-testid=${`epipolar-${s}`}>
        <path class="casing" d=${path(line)} />
        <path d=${path(line)} style=${`stroke:${LINE}`} />
      </g>
    </g>`
    }
    ${place && html`<${Foretold} s=${s} place=${place} />`}
    ${desk.doc.value.matches
      .map((match, index) => ({ point: match[s], index }))
      .toSorted((p, q) => rank(p.index) - rank(q.index))
      .map(
        ({ point, index }) =>
          point && html`<${Mark} key=${index} s=${s} index=${index} point=${point} />`,
      )}
  </svg>`;
}

/** Those with words beside them lie on top. @param {number} index */
const rank = (index) =>
  Number(matchErrors.value[index].isMistake) +
  2 * Number(hoveredMatch.value === index) +
  4 * Number(chosen.value?.index === index);

/** @param {{ s: Side, index: number, point: import("../../../core/types").Point }} props */
function Mark({ s, index, point }) {
  const [x, y] = views[s].toStage(...point),
    match = desk.doc.value.matches[index],
    { px, isMistake } = matchErrors.value[index];
  const waits = !(match.a && match.b),
    isChosen = chosen.value?.index === index,
    isNear = isChosen || hoveredMatch.value === index;
  const colour = waits ? WAITING : isMistake ? MISTAKE : MARK,
    label =
      px !== null && (isMistake || isNear)
        ? ` ${t("rig.match.mark.off", { error: number(px, 1) })}`
        : "";
  const toLeft = x > views[s].size.value.width - 90;
  return html`<g
    class=${`point${waits || isMistake ? " stray" : ""}`}
    style=${`--colour:${colour}`}
    transform=${`translate(${x} ${y})`}
    data-testid=${`mark-${s}-${index + 1}`}
    data-mistake=${isMistake}
    data-waits=${waits}
    data-chosen=${isChosen}
  >
    ${isChosen && html`<circle class="ring" r=${chosen.value?.side === s ? 10 : 8} />`}
    <circle class="mark" r="5.5" />
    ${isMistake && html`<path class="cross" d="M-5 -5L5 5M-5 5L5 -5" />`}
    <text class="name" style=${`fill:${colour}`} x=${toLeft ? -11 : 11} y="-7" text-anchor=${toLeft ? "end" : "start"}>
      ${index + 1}
      ${label}
    </text>
  </g>`;
}

/**
 * Where this image shows the thing if both calibrations are right and its height is.
 * @param {{ s: Side, place: import("../../../core/types").Point }} props
 */
function Foretold({ s, place }) {
  const [x, y] = views[s].toStage(...place),
    z = desk.doc.value.matches[linedMatch.value ?? -1]?.z_mm ?? 0;
  return html`<g class="next-click" data-testid=${`foretold-${s}`} transform=${`translate(${x} ${y})`}>
    <path class="casing" d="M0 -8L8 0L0 8L-8 0Z" />
    <path d="M0 -8L8 0L0 8L-8 0Z" style=${`stroke:${LINE}`} />
    <text x="0" y="22" text-anchor="middle">
      ${z ? t("rig.match.foretold.up", { height: number(z, 0) }) : t("rig.match.foretold.carpet")}
    </text>
  </g>`;
}

/** The loupe of one image. @param {{ s: Side, picture: import("preact").RefObject<HTMLImageElement> }} props */
export function MatchGlass({ s, picture }) {
  const at = pointed.value,
    point = at?.side === s && at.down ? chosenPoint() : null;
  const seen = at?.side === s ? at : null,
    here = point ? { x: point[0], y: point[1] } : seen;
  if (!seen || !here || tool.value === "pan" || (seen.touch && !seen.down)) return null;
  const { width, height } = views[s].size.value,
    [sx, sy] = views[s].toStage(here.x, here.y),
    { line } = epipolarLines.value[s];
  const place = {
    left: sx > width / 2 ? 8 : width - SIZE_PX - 8,
    top: sy > height / 2 ? 8 : height - SIZE_PX - 8,
  };
  return html`<${Glass}
    picture=${picture}
    at=${here}
    place=${place}
    k=${views[s].view.value.k}
    lines=${line ? [{ points: line, colour: LINE }] : []}
    rings=${desk.doc.value.matches.flatMap((m, i) =>
      m[s] ? [{ point: m[s], colour: matchErrors.value[i].isMistake ? MISTAKE : MARK }] : [],
    )}
  />`;
}
