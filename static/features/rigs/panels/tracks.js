// Ball and robots over a rig's picture of the whole field, each once, with how far apart the cameras see it.
import { mm, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { Title } from "../../../ui/title.js";
import { rig } from "../rig.js";
import { following, tracks, tracksRefusal } from "../tracks.js";

const ROBOT_MM = 90,
  BALL_MM = 43; // drawn so large: half across; a ball twice its size, to be found
const NEAR_MM = 5,
  FAR_MM = 15; // as verdicts have it

/** @typedef {import("../tracks.js").Track} Track @typedef {import("../../../core/types").Point} Point */

/** Over the stitched picture. @param {{ px: (p: Point) => Point, k: number }} props k: px a mm */
export function TrackMarks({ px, k }) {
  if (!following.value || !tracks.value) return null;
  return html`<g class="tracks" data-testid="tracks">
    ${tracks.value.items.map((it) => {
      const [x, y] = px([it.x_mm, it.y_mm]),
        r = (it.kind === "ball" ? BALL_MM : ROBOT_MM) * k;
      const turn = it.orientation_deg === null ? null : (it.orientation_deg * Math.PI) / 180;
      return html`<g
        key=${it.track}
        data-kind=${it.kind}
        data-team=${it.team ?? ""}
        data-level=${level(it.seam_mm)}
        data-testid=${`track-${it.kind}`}
      >
        <circle cx=${x} cy=${y} r=${r} />
        ${turn !== null && html`<path d=${`M${x} ${y}L${x + r * Math.cos(turn)} ${y - r * Math.sin(turn)}`} />`}
        <text x=${x + r + 4} y=${y + 5}>
          ${nameOf(it)}
          ${it.seam_mm === null ? "" : ` ${mm(it.seam_mm)} mm`}
        </text>
        <title>
          ${t("rig.tracks.seen", {
            thing: nameOf(it),
            x: number(it.x_mm, 0),
            y: number(it.y_mm, 0),
            cameras: it.cameras.join(t("rig.and")),
          })}
        </title>
      </g>`;
    })}
  </g>`;
}

/** At the right: what is seen, and the seam in words. */
export function TrackReport() {
  if (!following.value) return null;
  const it = tracks.value,
    titles = Object.fromEntries((rig.value?.cameras ?? []).map((c) => [c.camera, c.title]));
  const troubles = it?.cameras.filter((c) => c.problem) ?? [],
    why = tracksRefusal.value;
  return html`<section aria-label=${t("rig.tracks")} data-testid="track-report">
    <${Title} of="tracks">${t("rig.tracks")}<//>
    ${
      why
        ? html`<p class="warning-line" role="status">
        <b>${why.detail}</b> ${why.fix}
      </p>`
        : !it
          ? html`<p class="reason" role="status">${t("rig.tracks.waiting")}</p>`
          : html`
        <p data-testid="seam" data-level=${level(it.seams.median_mm)}>
          ${
            it.seams.things && it.seams.median_mm !== null
              ? html`
              ${rich("rig.tracks.seam", {
                count: it.seams.things,
                median: mm(it.seams.median_mm),
                most: mm(it.seams.max_mm ?? 0),
              })}
            `
              : t("rig.tracks.no-seam")
          }
        </p>
        <p class="reason">
          ${t(
            it.items.some(({ kind }) => kind === "ball")
              ? "rig.tracks.robots-ball"
              : "rig.tracks.robots-no-ball",
            {
              count: it.items.filter(({ kind }) => kind === "robot").length,
            },
          )}
        </p>
      `
    }
    ${troubles.map(
      (c) => html`<p key=${c.camera} class="warning-line">
      <b>${titles[c.camera] ?? c.camera}: ${c.problem?.what}</b>${" "}
      ${c.problem?.fix}
    </p>`,
    )}
  </section>`;
}

/** @param {number | null} seam_mm */
const level = (seam_mm) =>
  seam_mm === null ? "" : seam_mm <= NEAR_MM ? "good" : seam_mm <= FAR_MM ? "fair" : "poor";

/** "Y3", "B?", "ball". @param {Track} it */
const nameOf = (it) =>
  it.kind === "ball"
    ? t("rig.tracks.ball")
    : `${(it.team ?? "").charAt(0).toUpperCase()}${it.id ?? "?"}`;
