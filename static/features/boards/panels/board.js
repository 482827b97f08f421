// The board: which one it is, its pictures, and the lenses that were found before.
import { thumbnail } from "../../../core/api.js";
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { models } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { rich } from "../../../ui/rich.js";
import { Title } from "../../../ui/title.js";
import { Typed } from "../../../ui/typed.js";
import { Working } from "../../../ui/working.js";
import {
  boardRequest,
  changeBoard,
  lensForNextPicture,
  pictures,
  refusal,
  removePicture,
  removePictures,
  search,
  takeBoardPicture,
  viewReport,
} from "../board.js";
import { Pictures } from "../../lens_pictures/panels/picture_list.js";

const DICTIONARIES = [
  ...[4, 5, 6, 7].flatMap((n) => [50, 100, 250, 1000].map((count) => `DICT_${n}X${n}_${count}`)),
  "DICT_ARUCO_ORIGINAL",
  "DICT_APRILTAG_16h5",
  "DICT_APRILTAG_25h9",
  "DICT_APRILTAG_36h10",
  "DICT_APRILTAG_36h11",
];
// what boards are for; a board tells more than the others have numbers for
const WITH_LENS = new Set(["brown-conrady", "fisheye"]);

/** @typedef {{ target: HTMLInputElement & HTMLSelectElement }} Changed */

export function BoardForm() {
  const it = boardRequest.value;
  return html`
    <section aria-label=${t("board.form.board")}>
      <${Title} of="board">${t("board.form.board")}<//>
      <label class="pair tall">
        <span>${t("board.form.kind")}</span>
        <select
          data-testid="board-kind"
          value=${it.kind}
          onChange=${(/** @type {Changed} */ e) => changeBoard({ kind: e.target.value })}
        >
          <option value="chessboard">${t("board.form.chessboard")}</option>
          <option value="charuco">${t("board.form.charuco")}</option>
        </select>
      </label>
      <${Whole} name="columns" label=${t("board.form.corners-across")} />
      <${Whole} name="rows" label=${t("board.form.corners-down")} />
      <${Length} name="square_mm" label=${t("board.form.square")} />
      ${
        it.kind === "charuco" &&
        html`
        <${Length} name="marker_mm" label=${t("board.form.marker")} />
        <label class="pair tall">
          <span>${t("board.form.dictionary")}</span>
          <select
            data-testid="board-dictionary"
            value=${it.dictionary}
            onChange=${(/** @type {Changed} */ e) => changeBoard({ dictionary: e.target.value })}
          >
            ${DICTIONARIES.map(
              (d) => html`<option key=${d} value=${d}>
              ${d.replace("DICT_", "").replaceAll("_", " ")}
            </option>`,
            )}
          </select>
        </label>
        <label class="pair">
          <span>${t("board.form.legacy")}</span>
          <input
            type="checkbox"
            checked=${it.legacy}
            onChange=${(/** @type {Changed} */ e) => changeBoard({ legacy: e.target.checked })}
          />
        </label>
      `
      }
      <p class="reason">${t("board.form.inner-corners")}</p>
    </section>
    <section aria-label=${t("lens-pictures.lens")}>
      <${Title} of="lens">${t("lens-pictures.lens")}<//>
      <label class="pair tall">
        <span>${t("board.form.model")}</span>
        <select
          data-testid="board-model"
          value=${it.model}
          onChange=${(/** @type {Changed} */ e) => changeBoard({ model: e.target.value })}
        >
          ${models.value
            .filter((m) => WITH_LENS.has(m.name))
            .map(
              (m) => html`<option key=${m.name} value=${m.name}>
              ${m.title}
            </option>`,
            )}
        </select>
      </label>
      <label class="pair tall">
        <span>${t("board.form.note")}</span>
        <input
          type="text"
          data-testid="board-note"
          maxlength="200"
          placeholder=${t("board.form.note-example")}
          value=${it.note}
          onInput=${(/** @type {Changed} */ e) => changeBoard({ note: e.target.value })}
        />
      </label>
    </section>
  `;
}

/** @param {{ name: "columns" | "rows", label: string }} props */
const Whole = ({ name, label }) => html`<label class="pair">
  <span>${label}</span>
  <${Typed}
    type="number"
    data-testid=${`board-${name}`}
    min="2"
    max="100"
    step="1"
    value=${boardRequest.value[name]}
    take=${(/** @type {string} */ text) => changeBoard({ [name]: Number(text) })}
  />
</label>`;

/** @param {{ name: "square_mm" | "marker_mm", label: string }} props */
const Length = ({ name, label }) => html`<label class="pair length">
  <span>${label}</span>
  <span class="with-unit">
    <${Typed}
      type="number"
      data-testid=${`board-${name}`}
      min="0.1"
      step="any"
      value=${boardRequest.value[name]}
      take=${(/** @type {string} */ text) => changeBoard({ [name]: Number(text) })}
    />
    <small>mm</small>
  </span>
</label>`;

/** The middle of the page while it is at the board. */
export function BoardPage() {
  const now = search.value,
    all = pictures.value;
  return html`<div class="page" data-testid="board-desk">
    <h1>${t("board.desk.title")}</h1>
    <p class="dim">
      ${t("board.desk.purpose")}
    </p>
    <${Working}
      now=${now}
      what=${t("board.desk.finding")}
      stop="stop-finding"
      why=${refusal.value}
      name="board"
    />
    <${Pictures}
      of=${t("board.desk.pictures-of")}
      name="board"
      add="add-pictures"
      count=${all.length}
      busy=${now !== null}
      take=${takeBoardPicture}
      clear=${removePictures}
    >
      ${all.map((p) => html`<${View} key=${p.key} picture=${p} />`)}
    <//>
  </div>`;
}

/** One picture, and what was seen in it. @param {{ picture: import("../../../core/types").UploadedPicture }} props */
function View({ picture }) {
  const { key, name, state, id, why } = picture,
    seen = state === "kept" ? viewReport(picture) : null,
    view = seen?.view;
  const level =
    state === "refused" || (seen && !view)
      ? "poor"
      : view && !view.used
        ? "fair"
        : view
          ? "good"
          : "";
  return html`<li data-testid="view" data-level=${level}>
    ${
      id
        ? html`<img loading="lazy" alt="" src=${thumbnail(id)} />`
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
                : view?.used
                  ? html`
          <b class="level good">✓</b> ${number(view.rms_px, 2)} px, ${number(view.tilt_deg, 0)}°
          ${view.nearer ? ` ${view.nearer}` : ""}
        `
                  : html`
          <b class=${`level ${level}`}>${view ? t("board.view.left-out") : t("board.view.no-board")}</b> ${seen.why}
        `
      }
    </small>
  </li>`;
}

/** On the wall: the lens that the next picture gets. */
export function LensForNextPicture() {
  const lens = lensForNextPicture.value;
  return (
    lens &&
    html`<div class="plainly line" data-testid="held-next">
      <span>
        ${rich("board.next-picture.lens", {
          lens: lens.note || t("board.next-picture.from-board"),
          width: lens.image_size[0],
          height: lens.image_size[1],
        })}
      </span>
      <button
        type="button"
        onClick=${() => {
          lensForNextPicture.value = null;
        }}
      >
        ${t("board.next-picture.do-not-use")}
      </button>
    </div>`
  );
}
