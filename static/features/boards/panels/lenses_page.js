// The place Lenses: the lenses that were found, and the ways to find one.
import { useEffect } from "preact/hooks";
import { dayAndTime, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { cameras, notifyError } from "../../../core/state.js";
import { t } from "../../../core/words.js";
import { ActionButton } from "../../../ui/action_button.js";
import { openBoard, showLens } from "../board.js";
import { lenses, listLenses } from "../lenses.js";

export function LensesPage() {
  useEffect(() => {
    void listLenses();
  }, []);
  return html`<div class="page" data-testid="lenses-page">
    <h1>${t("board.lenses.title")}</h1>
    <p class="dim">${t("board.lenses.purpose")}</p>
    <ul class="cards" data-testid="lens-ways">
      <li class="card">
        <b>${t("shell.view.board")}</b>
        <small>${t("board.lenses.by-board")}</small>
        <${ActionButton} id="board" />
        <${With} view="capture" />
      </li>
      <li class="card">
        <b>${t("shell.view.edges")}</b>
        <small>${t("board.lenses.by-edges")}</small>
        <${ActionButton} id="straight" />
      </li>
      <li class="card">
        <b>${t("shell.view.ball")}</b>
        <small>${t("board.lenses.by-ball")}</small>
        <${With} view="ball" />
      </li>
    </ul>
    <section aria-label=${t("board.lenses.found")}>
      <h2>${t("board.lenses.found-count", { count: lenses.value.length })}</h2>
      <ul class="versions" data-testid="lenses">
        ${lenses.value.map(
          (l) => html`<li key=${l.id}>
          <div>
            <b>
              ${
                l.note ||
                (l.board
                  ? t("board.lenses.board", {
                      columns: l.board.columns,
                      rows: l.board.rows,
                      kind: l.board.kind,
                    })
                  : t("common.corners"))
              }
            </b>
          </div>
          <em>${t("board.lenses.rms", { rms: number(l.rms_px, 2) })}</em>
          <small>
            ${t("board.lenses.details", {
              when: dayAndTime(l.created_at),
              count: l.views,
              width: l.image_size[0],
              height: l.image_size[1],
            })}
          </small>
          <button type="button" onClick=${() => void show(l.id)}>${t("board.lenses.show-report")}</button>
        </li>`,
        )}
      </ul>
    </section>
  </div>`;
}

/** The cameras with which it is done live. @param {{ view: "capture" | "ball" }} props */
const With = ({ view }) => html`<div class="line wrap">
  ${cameras.value.map(
    ({ id, name }) => html`<a key=${id} href=${addressOf(view, { camera: id })}>
    ${t("board.lenses.with", { camera: name })}
  </a>`,
  )}
</div>`;

/** @param {string} id */
async function show(id) {
  await openBoard();
  await showLens(id).catch(notifyError);
}
