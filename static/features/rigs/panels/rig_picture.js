// A rig's field in one picture: over it each camera's name, how far neighbours are apart, and the map of that.
import { mm, shortened } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { fields } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import {
  FieldPlan,
  Markings,
  frameOf,
  middleOf,
  outline,
  placeIn,
} from "../../../ui/field_plan.js";
import { MapScale, shadeOf } from "../../../ui/map_scale.js";
import { found, plane, showMap, stitched, worst } from "../rig.js";
import { absence, seams } from "../seams.js";
import { TrackMarks } from "./tracks.js";

/** @typedef {import("../types").Pair} Pair @typedef {import("../../../core/types").Point} Point */

const NAME = 20; // characters of a camera's name
const INSET_PX = 6;

/**
 * The whole field: its picture, or its lines while there is none; over it cameras, seams and the map.
 * @param {{ it: import("../types").Rig }} props
 */
export function RigPicture({ it }) {
  const now = stitched.value?.of === it.name ? stitched.value : null,
    info = now?.info ?? null,
    field = fields.value.find((f) => f.name === it.field);
  const frame = info ? frameOfPicture(info) : field && frameOf(field);
  if (!frame || !field) return null;
  const px = placeIn(frame),
    top = worst.value,
    mark = showMap.value && top ? px(top.at.where) : null;
  const outside = it.cameras.filter((c) => !info || absence(c));
  return html`<figure class="stitched">
    <${FieldPlan}
      frame=${frame}
      picture=${now?.picture}
      alt=${t("rig.picture.alt")}
      testid="rig-overlay"
      label=${top ? t("rig.overlay.worst", { worst: mm(top.at.max_mm) }) : t("rig.overlay.lines")}
      labels=${[...it.cameras.map((c) => cameraLabel(c, field)), ...seams.value.map(seamLabel)]}
    >
      ${
        showMap.value &&
        (found.value?.pairs ?? []).map(
          (p) => html`<${Cells} key=${`${p.a} ${p.b}`} pair=${p} px=${px} k=${frame.k} />`,
        )
      }
      ${outside.map((c) => {
        const edge = outline(areaOf(c, field), px, INSET_PX);
        return html`<path key=${c.camera} class="area absent" d=${edge} />`;
      })}
      <${Markings} field=${field} place=${px} />
      ${seams.value.map(
        ({ key, area, figures }) =>
          html`<path key=${key} class="seam" data-level=${levelOf(figures)} d=${outline(area, px)} />`,
      )}
      <${TrackMarks} px=${px} k=${frame.k} />
      ${
        mark &&
        top &&
        html`<g class="where" data-testid="rig-worst" transform=${`translate(${mark[0]} ${mark[1]})`}>
          <title>${t("rig.picture.worst", { worst: mm(top.at.max_mm) })}</title>
          <circle r="12" />
          <path d="M-7-7L7 7M-7 7L7-7" />
        </g>`
      }
    <//>
    <figcaption>
      ${showMap.value && top && html`<${MapScale} />`}
      <p class="reason" data-testid="unseen">${info ? info.unseen.words : now ? "" : t("rig.picture.taking")}</p>
    </figcaption>
  </figure>`;
}

/** Its first pixel's centre is the first corner. @param {import("../types").Stitched} info */
const frameOfPicture = ({ width, height, px_per_mm: k, corner: [[x0, y0]] }) => ({
  width,
  height,
  k,
  x0,
  y0,
});

/**
 * In the middle of what it covers; where it is not in the picture, why, and what to press.
 * @param {import("../seams.js").Member} camera @param {import("../../../core/types").Field} field
 */
function cameraLabel(camera, field) {
  const { camera: id, title } = camera,
    why = absence(camera);
  return {
    key: id,
    testid: `over-${id}`,
    at: middleOf(areaOf(camera, field)),
    text: html`<b title=${title}>${shortened(title, NAME)}</b>${
      why &&
      html`
      <small>${t(`rig.absent.${why}`)}</small>
      <a href=${addressOf(why === "no-image" ? "live" : "camera-images", { camera: id })}>
        ${t(why === "no-image" ? "rig.absent.start" : "rig.absent.calibrate")}
      </a>
    `
    }`,
  };
}

/** The whole field where nothing names its area yet.
 * @param {import("../seams.js").Member} camera @param {import("../../../core/types").Field} field */
const areaOf = ({ area }, { regions }) => area ?? Object.values(regions)[0];

/** @param {typeof seams.value[0]} seam */
function seamLabel({ key, area, figures }) {
  const isKnown = typeof figures === "object";
  return {
    key,
    testid: `seam-${key}`,
    at: middleOf(area),
    level: levelOf(figures),
    text: isKnown
      ? html`<b class=${`level ${figures.level}`}>${t(`common.level.${figures.level}`)}</b>
        <small>${t("rig.seam.figures", { median: mm(figures.median_mm), most: mm(figures.max_mm) })}</small>`
      : html`<small>${t(`rig.seam.${figures}`)}</small>`,
  };
}

/** @param {typeof seams.value[0]["figures"]} figures */
const levelOf = (figures) => (typeof figures === "object" ? figures.level : null);

/** One pair's map. @param {{ pair: Pair, px: (p: Point) => Point, k: number }} props */
function Cells({ pair, px, k }) {
  const at = pair.agreement?.[plane.value];
  if (!at) return null;
  const { x, y, mm: cells } = at.map,
    w = (x[1] - x[0]) * k,
    h = (y[1] - y[0]) * k;
  return html`<g class="cells" data-testid="cells">
    ${cells.flatMap((row, j) =>
      row.map((v, i) => {
        if (v === null) return null;
        const [cx, cy] = px([x[i], y[j]]);
        return html`<rect key=${`${i},${j}`} x=${cx - w / 2} y=${cy - h / 2} width=${w} height=${h} fill=${shadeOf(v)}>
          <title>${mm(v)} mm</title>
        </rect>`;
      }),
    )}
  </g>`;
}
