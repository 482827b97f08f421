// Straight edges: pictures of one camera, their edges drawn over them, as taken and straightened.
import { run } from "../../../core/actions.js";
import { address, thumbnail } from "../../../core/api.js";
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { Title } from "../../../ui/title.js";
import { Working } from "../../../ui/working.js";
import { Pictures } from "../../lens_pictures/panels/picture_list.js";
import {
  chooseKind,
  edges,
  isResultCurrent,
  kind,
  pictures,
  pointed,
  refusal,
  removePicture,
  removePictures,
  search,
  showStraight,
  shownPicture,
  straightened,
  straightnessResult,
  takeEdgePicture,
  viewPicture,
  viewedPicture,
} from "../straight.js";

/** @typedef {import("../../../core/types").Edge} Edge @typedef {import("../../../core/types").Point} Point */

/** What may be looked for, in the operator's words. @type {[string, string, string][]} */
export const KINDS = [
  ["auto", t("straight.kind.auto"), t("straight.kind.auto.use")],
  ["division", t("straight.kind.division"), t("straight.kind.division.use")],
  ["division-even", t("straight.kind.division-even"), t("straight.kind.division-even.use")],
  ["brown-conrady", t("straight.kind.brown-conrady"), t("straight.kind.brown-conrady.use")],
];
/** How far off a straight line, px rms, up to which an edge has which colour. @type {[number, string][]} */
const STEPS = [
  [0.3, t("straight.colours.up-to", { limit: "0.3" })],
  [1, t("straight.colours.to", { limit: "1" })],
  [3, t("straight.colours.to", { limit: "3" })],
  [Infinity, t("straight.colours.more")],
];

export const StraightForm = () => html`
  <section aria-label=${t("lens-pictures.lens")}>
    <h2>${t("lens-pictures.lens")}</h2>
    <label class="pair tall">
      <span>${t("straight.lens-kind")}</span>
      <select
        data-testid="straight-kind"
        value=${kind.value}
        onChange=${(/** @type {any} */ e) => chooseKind(e.target.value)}
      >
        ${KINDS.map(
          ([id, label]) => html`<option key=${id} value=${id}>
          ${label}
        </option>`,
        )}
      </select>
    </label>
    <p class="reason">${KINDS.find(([id]) => id === kind.value)?.[2]}</p>
  </section>
  <section>
    <${Title} of="straight">${t("straight.good-pictures.title")}<//>
    <ul class="plain">
      <li>${rich("straight.good-pictures.long-edges")}</li>
      <li>${rich("straight.good-pictures.far-from-middle")}</li>
      <li>${rich("straight.good-pictures.directions")}</li>
      <li>${rich("straight.good-pictures.one-camera")}</li>
    </ul>
  </section>
`;

export function StraightPage() {
  const now = search.value;
  return html`<div class="page" data-testid="straight-desk">
    <h1>${t("straight.desk.title")}</h1>
    <p class="dim">
      ${t("straight.desk.purpose")}
    </p>
    <${Working}
      now=${now}
      what=${t("straight.desk.judging")}
      stop="stop-judging"
      why=${refusal.value}
      name="straight"
    />
    ${viewedPicture.value && html`<${Figure} picture=${viewedPicture.value} />`}
    <${Pictures}
      of=${t("straight.desk.pictures-of")}
      name="straight"
      add="add-edges"
      count=${pictures.value.length}
      busy=${now !== null}
      take=${takeEdgePicture}
      clear=${removePictures}
    >
      ${pictures.value.map((p) => html`<${View} key=${p.key} picture=${p} />`)}
    <//>
  </div>`;
}

/** One picture, large, with its edges. @param {{ picture: import("../../../core/types").UploadedPicture }} props */
function Figure({ picture }) {
  const isKnown = isResultCurrent.value,
    isStraight = isKnown && shownPicture.value.straight,
    there = straightened.value?.of === picture.id ? straightened.value.url : "";
  const [width, height] = straightnessResult.value?.report.lens.image_size ?? [4, 3];
  return html`<figure class="edges" data-testid="edges" data-shown=${isStraight ? "straight" : "taken"}>
    <div class="sheet" style=${isKnown ? `aspect-ratio:${width}/${height}` : ""}>
      ${
        isStraight && !there
          ? html`<p class="reason">${t("straight.figure.straightening")}</p>`
          : html`<img
          alt=${isStraight ? t("straight.figure.without-bend") : t("straight.figure.picture-as-taken")}
          data-testid="edges-picture"
          src=${isStraight ? there : address(`/snapshots/${picture.id}/image.jpg`)}
        />`
      }
      ${
        isKnown &&
        html`
        <svg viewBox=${`-0.5 -0.5 ${width} ${height}`} preserveAspectRatio="none" aria-hidden="true">
          ${edges.value.map((e) => html`<${Chain} key=${e.name} edge=${e} straight=${isStraight} />`)}
        </svg>
        ${!isStraight && html`<${MostBent} size=${[width, height]} />`}
      `
      }
    </div>
    ${
      isKnown &&
      html`<figcaption class="line">
      <div class="switch" role="group" aria-label=${t("straight.figure.show")}>
        <button
          type="button"
          data-testid="as-taken"
          aria-pressed=${String(!isStraight)}
          onClick=${() => showStraight(false)}
        >
          ${t("straight.figure.as-taken")}
        </button>
        <button
          type="button"
          data-testid="as-straightened"
          aria-pressed=${String(isStraight)}
          onClick=${() => showStraight(true)}
        >
          ${t("straight.figure.straightened")}
        </button>
      </div>
      <span class="key">
        ${STEPS.map(
          ([, label], i) => html`<span key=${label}>
          <i class=${`e${i}`}></i>
          ${label}
        </span>`,
        )}
        <span>
          <i class="left"></i>${t("straight.colours.left-out")}
        </span>
      </span>
      <small data-testid="pointed">
        ${
          describe(edges.value.find((e) => e.name === pointed.value)) ||
          t("straight.figure.edges", { count: edges.value.length })
        }
      </small>
    </figcaption>`
    }
  </figure>`;
}

/** @param {{ edge: Edge, straight: boolean }} props */
function Chain({ edge, straight }) {
  const px = straight ? edge.after_px : edge.before_px,
    d = path(straight ? edge.straight : edge.chain);
  const colour = px === null ? "none" : `e${STEPS.findIndex(([most]) => px <= most)}`;
  return html`<g
    class=${`${colour}${edge.used ? "" : " left"}${edge.name === pointed.value ? " pointed" : ""}`}
    data-testid="edge"
    data-used=${edge.used}
    onPointerEnter=${() => {
      pointed.value = edge.name;
    }}
  >
    <path class="casing" d=${d} />
    <path d=${d} />
    <path class="hit" d=${d} />
  </g>`;
}

/** The chord of the edge that bows most, and how far it does. @param {{ size: Point }} props */
function MostBent({ size: [width, height] }) {
  const bow = straightnessResult.value?.report.bow.most,
    at = straightnessResult.value?.report.lines[bow?.line ?? -1],
    ends = at && [at.chain[0], at.chain.at(-1)];
  if (
    !bow ||
    !at ||
    !ends?.[0] ||
    !ends[1] ||
    bow.px === null ||
    !edges.value.includes(at) ||
    straightnessResult.value?.report.distortion !== "significant"
  )
    return null;
  const [a, b] = [ends[0], ends[1]];
  return html`
    <svg viewBox=${`-0.5 -0.5 ${width} ${height}`} preserveAspectRatio="none" aria-hidden="true">
      <path class="chord" d=${path([a, b])} />
    </svg>
    <span
      class="bow"
      data-testid="bow-label"
      style=${`left:${(50 * (a[0] + b[0])) / width}%;top:${(50 * (a[1] + b[1])) / height}%`}
    >
      ${t("straight.figure.bow", { bow: number(bow.px) })}
    </span>
  `;
}

/** @param {(Point | null)[]} points */
const path = (points) =>
  points.map((p, i) => (p ? `${i && points[i - 1] ? "L" : "M"}${p[0]} ${p[1]}` : "")).join("");

/** @param {Edge | undefined} edge */
const describe = (edge) =>
  edge &&
  t(edge.used ? "straight.edge.counted" : "straight.edge.left-out", {
    name: edge.name,
    length: number(edge.length_px, 0),
    before: number(edge.before_px, 2),
    after: number(edge.after_px, 2),
    reason: String(edge.reason).replaceAll("-", " "),
  });

/**
 * One picture, small, and how many of its edges counted.
 * @param {{ picture: import("../../../core/types").UploadedPicture }} props
 */
function View({ picture: { key, name, state, id, why } }) {
  const at = isResultCurrent.value ? (straightnessResult.value?.ids.indexOf(id) ?? -1) : -1,
    seen =
      at < 0
        ? null
        : (straightnessResult.value?.report.lines.filter((line) => line.picture === at) ?? null);
  return html`<li
    data-testid="view"
    data-level=${state === "refused" ? "poor" : seen && !seen.some((e) => e.used) ? "fair" : ""}
  >
    ${
      id
        ? html`<button
        type="button"
        class="looked"
        aria-label=${t("straight.show-picture", { name })}
        aria-pressed=${String(viewedPicture.value?.id === id)}
        onClick=${() => viewPicture(id)}
      >
        <img loading="lazy" alt="" src=${thumbnail(id)} />
      </button>`
        : html`<div class="blank"></div>`
    }
    <button
      type="button"
      class="remove"
      aria-label=${t("lens-pictures.remove", { name })}
      title=${t("lens-pictures.remove-picture")}
      disabled=${search.value !== null}
      onClick=${() => removePicture(key)}
    >
      ×
    </button>
    <small class="name" title=${name}>
      ${name}
    </small>
    <small>
      ${
        state === "waiting"
          ? t("lens-pictures.state.waiting")
          : state === "uploading"
            ? t("lens-pictures.state.uploading")
            : state === "refused"
              ? why
              : !seen
                ? t("lens-pictures.state.uploaded")
                : t("straight.edges-used", {
                    used: seen.filter((e) => e.used).length,
                    count: seen.length,
                  })
      }
    </small>
  </li>`;
}

/** The right side: the verdict, numbers with their units, and what was left out. */
export function StraightReport() {
  if (!straightnessResult.value || !isResultCurrent.value)
    return html`<section>
      <${Title} of="edges">${t("straight.tells.title")}<//>
      <ul class="plain">
        <li>${rich("straight.tells.bow")}</li>
        <li>${rich("straight.tells.straightness")}</li>
        <li>${rich("straight.tells.lens")}</li>
        <li>${rich("straight.tells.nothing")}</li>
      </ul>
    </section>`;
  const it = straightnessResult.value.report,
    { most, border } = it.bow,
    left = it.lines.filter((line) => !line.used);
  return html`
    <section aria-label=${t("common.verdict")}>
      <${Title} of="edges">${t("common.distortion")}<//>
      <div class="verdict" data-testid="straight-verdict" data-distortion=${it.distortion}>
        <div class="big">${WORDS[it.distortion]}</div>
        <p>${it.sentence}</p>
        <dl>
          <div>
            <dd data-testid="straight-bow">${withSigma(most)}</dd>
            <dt>${t("straight.report.most-bowed")}</dt>
          </div>
          <div>
            <dd>${number(most.pct, 2)} %</dd>
            <dt>${t("straight.report.of-its-length")}</dt>
          </div>
          <div>
            <dd data-testid="straight-before">${number(it.straightness_px.before, 2)} px</dd>
            <dt>${t("straight.report.rms-as-taken")}</dt>
          </div>
          <div>
            <dd data-testid="straight-after">${number(it.straightness_px.after, 2)} px</dd>
            <dt>${t("straight.report.rms-straightened")}</dt>
          </div>
        </dl>
      </div>
      <p class="reason">
        ${t("straight.report.border", {
          border: withSigma(border),
          used: it.lines_used,
          count: it.lines.length,
          objects: t("straight.report.objects", { count: it.objects }),
        })}
      </p>
    </section>
    <section aria-label=${t("lens-pictures.lens")}>
      <h2>${t("lens-pictures.lens")}</h2>
      <p data-testid="straight-lens-kind">${KINDS.find(([id]) => id === it.lens.name)?.[1] ?? it.lens.name}</p>
      <dl class="details" data-testid="straight-lens">
        ${Object.entries(it.sigma)
          .filter(([name]) => name in it.lens.terms)
          .map(
            ([name, sigma]) => html`<div key=${name}>
            <dt>${name}</dt>
            <dd>
              ${number(it.lens.terms[name], 4)} ± ${number(sigma, 4)}
            </dd>
          </div>`,
          )}
        <div>
          <dt>${t("straight.report.centre")}</dt>
          <dd>
            ${number(it.lens.centre_px[0])}, ${number(it.lens.centre_px[1])} px
          </dd>
        </div>
      </dl>
      <p class="reason">
        ${t("straight.report.terms", { unit: number(it.lens.unit_px, 1), cannotSee: it.cannot_see })}
      </p>
      <div class="line">
        <button type="button" data-testid="to-board" onClick=${() => run("board")}>
          ${t("board.action.board")}
        </button>
      </div>
    </section>
    ${
      left.length > 0 &&
      html`<section aria-label=${t("straight.left-out.title")}>
      <h2>${t("straight.left-out.count", { count: left.length })}</h2>
      <p class="reason">${t("straight.left-out.doubt")}</p>
      <ul class="plain" data-testid="left-out">
        ${left.slice(0, MAX_LISTED).map(
          (e) => html`<li key=${e.name}>
          <button
            type="button"
            class="plain-link"
            onClick=${() => {
              const { ids } = straightnessResult.value ?? { ids: [] };
              viewPicture(ids[e.picture]);
              pointed.value = e.name;
            }}
          >
            ${e.name}
          </button>${" "}
          ${String(e.reason).replaceAll("-", " ")}
        </li>`,
        )}
        ${
          left.length > MAX_LISTED &&
          html`<li>
          ${t("straight.left-out.more", { count: left.length - MAX_LISTED })}
        </li>`
        }
      </ul>
    </section>`
    }
  `;
}

/** @param {import("../../../core/types").Bow} bow */
const withSigma = ({ px, sigma_px: sigma }) =>
  `${number(px, digits(sigma))} ± ${number(sigma, digits(sigma))} px`;

/** @param {number | null} sigma */
const digits = (sigma) => (sigma !== null && sigma < 0.095 ? 2 : 1);

/** @type {Record<string, string>} */
const WORDS = {
  significant: t("straight.distortion.significant"),
  none: t("straight.distortion.none"),
  unknown: t("straight.distortion.unknown"),
};
const MAX_LISTED = 12;
