// How things are drawn on the picture: colours, and paths in picture pixels.

/**
 * The same colour wherever a border appears; told apart by colour-blind eyes (Okabe and Ito's palette).
 * @type {Record<string, string>}
 */
const COLOURS = { left: "#56b4e9", right: "#e69f00", top: "#cc79a7", bottom: "#f0e442" };

/** @param {string} feature */
export const colour = (feature) => COLOURS[feature] ?? "#7fe0b0";

/**
 * An SVG path through points in picture pixels; a gap where one is out of reach.
 * @param {(import("../core/types").Point | null)[]} points
 */
export function path(points) {
  let pen = "M";
  return points
    .map((p) => {
      if (!p) {
        pen = "M";
        return "";
      }
      const move = `${pen}${p[0].toFixed(3)} ${p[1].toFixed(3)}`;
      pen = "L";
      return move;
    })
    .join("");
}

/**
 * Transform of a group that is drawn in picture pixels: (0, 0) is the centre of the first pixel.
 * @param {number} x
 * @param {number} y
 * @param {number} k
 */
export const placed = (x, y, k) => `translate(${x} ${y}) scale(${k}) translate(.5 .5)`;

/** Smallest box around points. @param {(import("../core/types").Point | null)[]} points */
export function bounds(points) {
  const seen = points.filter((p) => p !== null);
  const xs = seen.map((p) => p[0]),
    ys = seen.map((p) => p[1]);
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  return { width: x1 - x0, height: y1 - y0, x: (x0 + x1) / 2, y: (y0 + y1) / 2 };
}
