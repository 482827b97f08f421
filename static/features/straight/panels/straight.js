// Straight edges: pictures of one camera, their edges drawn over them, as taken and straightened.
import { run } from "../../../core/actions.js";
import { address, thumbnail } from "../../../core/api.js";
import { number, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
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
  ["auto", "Choose by itself", "The simplest that makes edges straight."],
  ["division", "Division, one term", "For most lenses."],
  ["division-even", "Division, two terms", "For wide lenses."],
  ["brown-conrady", "Brown–Conrady, two terms", "As OpenCV counts k1 and k2; not for wide lenses."],
];
/** How far off a straight line, px rms, up to which an edge has which colour. @type {[number, string][]} */
const STEPS = [
  [0.3, "up to 0.3"],
  [1, "to 1"],
  [3, "to 3"],
  [Infinity, "more px rms"],
];

export const StraightForm = () => html`
  <section aria-label="Lens">
    <h2>Lens</h2>
    <label class="pair tall">
      <span>Kind</span>
      <select
        data-testid="straight-kind"
        value=${kind.value}
        onChange=${(/** @type {any} */ e) => chooseKind(e.target.value)}
      >
        ${KINDS.map(([id, label]) => html`<option key=${id} value=${id}>
          ${label}
        </option>`)}
      </select>
    </label>
    <p class="reason">${KINDS.find(([id]) => id === kind.value)?.[2]}</p>
  </section>
  <section>
    <${Title} of="straight">Good pictures<//>
    <ul class="plain">
      <li>
        <b>Long edges</b>, straight in the world: walls, doors, shelves, a field's lines.
      </li>
      <li>
        <b>Far from the middle</b>: an edge through the centre stays straight behind any lens.
      </li>
      <li>
        <b>Several directions</b>, several things.
      </li>
      <li>
        <b>One camera</b>, zoom and focus untouched.
      </li>
    </ul>
  </section>
`;

export function StraightPage() {
  const now = search.value;
  return html`<div class="page" data-testid="straight-desk">
    <h1>Check a lens by straight edges</h1>
    <p class="dim">
      What is straight in the world should be straight in the picture. No field and no board is needed; in
      return it tells neither a focal length nor millimetres.
    </p>
    <${Working} now=${now} what="Judging the edges" stop="stop-judging" why=${refusal.value} name="straight" />
    ${viewedPicture.value && html`<${Figure} picture=${viewedPicture.value} />`}
    <${Pictures}
      of="one camera"
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
      ${isStraight && !there
        ? html`<p class="reason">Straightening…</p>`
        : html`<img
          alt=${isStraight ? "The picture without its bend" : "The picture as taken"}
          data-testid="edges-picture"
          src=${isStraight ? there : address(`/snapshots/${picture.id}/image.jpg`)}
        />`}
      ${isKnown && html`
        <svg viewBox=${`-0.5 -0.5 ${width} ${height}`} preserveAspectRatio="none" aria-hidden="true">
          ${edges.value.map((e) => html`<${Chain} key=${e.name} edge=${e} straight=${isStraight} />`)}
        </svg>
        ${!isStraight && html`<${MostBent} size=${[width, height]} />`}
      `}
    </div>
    ${isKnown && html`<figcaption class="line">
      <div class="switch" role="group" aria-label="Show">
        <button
          type="button"
          data-testid="as-taken"
          aria-pressed=${String(!isStraight)}
          onClick=${() => showStraight(false)}
        >
          As taken
        </button>
        <button
          type="button"
          data-testid="as-straightened"
          aria-pressed=${String(isStraight)}
          onClick=${() => showStraight(true)}
        >
          Straightened
        </button>
      </div>
      <span class="key">
        ${STEPS.map(([, label], i) => html`<span key=${label}>
          <i class=${`e${i}`}></i>
          ${label}
        </span>`)}
        <span>
          <i class="left"></i>left out
        </span>
      </span>
      <small data-testid="pointed">
        ${describe(edges.value.find((e) => e.name === pointed.value)) ||
          `${plural(edges.value.length, "edge")}; point at one for its numbers.`}
      </small>
    </figcaption>`}
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
      bows by ${number(bow.px)} px
    </span>
  `;
}

/** @param {(Point | null)[]} points */
const path = (points) =>
  points.map((p, i) => (p ? `${i && points[i - 1] ? "L" : "M"}${p[0]} ${p[1]}` : "")).join("");

/** @param {Edge | undefined} edge */
const describe = (edge) =>
  edge &&
  `${edge.name}: ${number(edge.length_px, 0)} px long, straight to ${number(edge.before_px, 2)} px as taken, ` +
    `${number(edge.after_px, 2)} px ` +
    `straightened${edge.used ? "" : `; left out, ${String(edge.reason).replaceAll("-", " ")}`}`;

/**
 * One picture, small, and how many of its edges counted.
 * @param {{ picture: import("../../../core/types").UploadedPicture }} props
 */
function View({ picture: { key, name, state, id, why } }) {
  const at = isResultCurrent.value ? (straightnessResult.value?.ids.indexOf(id) ?? -1) : -1,
    seen =
      at < 0 ? null : (straightnessResult.value?.report.lines.filter((line) => line.picture === at) ?? null);
  return html`<li
    data-testid="view"
    data-level=${state === "refused" ? "poor" : seen && !seen.some((e) => e.used) ? "fair" : ""}
  >
    ${id
      ? html`<button
        type="button"
        class="looked"
        aria-label=${`Show ${name}`}
        aria-pressed=${String(viewedPicture.value?.id === id)}
        onClick=${() => viewPicture(id)}
      >
        <img loading="lazy" alt="" src=${thumbnail(id)} />
      </button>`
      : html`<div class="blank"></div>`}
    <button
      type="button"
      class="remove"
      aria-label=${`Remove ${name}`}
      title="Remove this picture"
      disabled=${search.value !== null}
      onClick=${() => removePicture(key)}
    >
      ×
    </button>
    <small class="name" title=${name}>
      ${name}
    </small>
    <small>
      ${state === "waiting"
        ? "Waiting…"
        : state === "uploading"
          ? "Uploading…"
          : state === "refused"
            ? why
            : !seen
              ? "Uploaded"
              : `${seen.filter((e) => e.used).length} of ${plural(seen.length, "edge")}`}
    </small>
  </li>`;
}

/** The right side: the verdict, numbers with their units, and what was left out. */
export function StraightReport() {
  if (!straightnessResult.value || !isResultCurrent.value)
    return html`<section>
      <${Title} of="edges">What it tells<//>
      <ul class="plain">
        <li>
          <b>How far the lens bows</b> a straight edge, in px and % of its length.
        </li>
        <li>
          <b>How straight edges are</b> before and after that is taken out.
        </li>
        <li>
          <b>The lens</b>, each term with its σ.
        </li>
        <li>
          Or that there is <b>no significant distortion</b>, or that these edges do not tell.
        </li>
      </ul>
    </section>`;
  const it = straightnessResult.value.report,
    { most, border } = it.bow,
    left = it.lines.filter((line) => !line.used);
  return html`
    <section aria-label="Verdict">
      <${Title} of="edges">Distortion<//>
      <div class="verdict" data-testid="straight-verdict" data-distortion=${it.distortion}>
        <div class="big">${WORDS[it.distortion]}</div>
        <p>${it.sentence}</p>
        <dl>
          <div>
            <dd data-testid="straight-bow">${withSigma(most)}</dd>
            <dt>most bowed edge</dt>
          </div>
          <div>
            <dd>${number(most.pct, 2)} %</dd>
            <dt>of its length</dt>
          </div>
          <div>
            <dd data-testid="straight-before">${number(it.straightness_px.before, 2)} px</dd>
            <dt>as taken, rms</dt>
          </div>
          <div>
            <dd data-testid="straight-after">${number(it.straightness_px.after, 2)} px</dd>
            <dt>straightened, rms</dt>
          </div>
        </dl>
      </div>
      <p class="reason">
        A line along the picture's own edge would bow by ${withSigma(border)}. ${it.lines_used} of${" "}
        ${plural(it.lines.length, "edge")} counted, of ${plural(it.objects, "object")}.
      </p>
    </section>
    <section aria-label="Lens">
      <h2>Lens</h2>
      <p data-testid="straight-lens-kind">${KINDS.find(([id]) => id === it.lens.name)?.[1] ?? it.lens.name}</p>
      <dl class="details" data-testid="straight-lens">
        ${Object.entries(it.sigma)
          .filter(([name]) => name in it.lens.terms)
          .map(([name, sigma]) => html`<div key=${name}>
            <dt>${name}</dt>
            <dd>
              ${number(it.lens.terms[name], 4)} ± ${number(sigma, 4)}
            </dd>
          </div>`)}
        <div>
          <dt>centre</dt>
          <dd>
            ${number(it.lens.centre_px[0])}, ${number(it.lens.centre_px[1])} px
          </dd>
        </div>
      </dl>
      <p class="reason">
        Terms per half diagonal, ${number(it.lens.unit_px, 1)} px. ${it.cannot_see} So no camera's fit can hold
        it; a lens from a board it can.
      </p>
      <div class="line">
        <button type="button" data-testid="to-board" onClick=${() => run("board")}>
          Calibrate a lens with a board…
        </button>
      </div>
    </section>
    ${left.length > 0 && html`<section aria-label="Edges left out">
      <h2>${plural(left.length, "edge")} left out</h2>
      <p class="reason">A straight thing among them speaks against the lens.</p>
      <ul class="plain" data-testid="left-out">
        ${left.slice(0, MAX_LISTED).map((e) => html`<li key=${e.name}>
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
        </li>`)}
        ${left.length > MAX_LISTED && html`<li>and ${left.length - MAX_LISTED} more</li>`}
      </ul>
    </section>`}
  `;
}

/** @param {import("../../../core/types").Bow} bow */
const withSigma = ({ px, sigma_px: sigma }) =>
  `${number(px, digits(sigma))} ± ${number(sigma, digits(sigma))} px`;

/** @param {number | null} sigma */
const digits = (sigma) => (sigma !== null && sigma < 0.095 ? 2 : 1);

/** @type {Record<string, string>} */
const WORDS = { significant: "Significant", none: "None", unknown: "Not known" };
const MAX_LISTED = 12;
