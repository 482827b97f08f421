// The place Lenses: the lenses that were found, and the ways to find one.
import { useEffect } from "preact/hooks";
import { dayAndTime, number, plural } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { addressOf } from "../../../core/route.js";
import { cameras, notifyError } from "../../../core/state.js";
import { ActionButton } from "../../../ui/action_button.js";
import { openBoard, showLens } from "../board.js";
import { lenses, listLenses } from "../lenses.js";

export function LensesPage() {
  useEffect(() => {
    void listLenses();
  }, []);
  return html`<div class="page" data-testid="lenses-page">
    <h1>Lenses</h1>
    <p class="dim">A lens that is known first leaves only the camera's place to the field lines.</p>
    <div class="line wrap">
      <${ActionButton} id="board" />
      <${ActionButton} id="straight" />
      ${cameras.value.map(({ id, name }) => html`<a key=${id} href=${addressOf("capture", { camera: id })}>
        Board before ${name}
      </a>`)}
    </div>
    <section aria-label="Lenses found before">
      <h2>${plural(lenses.value.length, "lens", "lenses")} found before</h2>
      <ul class="versions" data-testid="lenses">
        ${lenses.value.map((l) => html`<li key=${l.id}>
          <div>
            <b>
              ${l.note || (l.board ? `${l.board.columns} × ${l.board.rows} ${l.board.kind}` : "Corners")}
            </b>
          </div>
          <em>${number(l.rms_px, 2)} px rms</em>
          <small>
            ${dayAndTime(l.created_at)}, ${plural(l.views, "view")}, ${l.image_size[0]} × ${l.image_size[1]}${" "}
            px
          </small>
          <button type="button" onClick=${() => void show(l.id)}>Show its report</button>
        </li>`)}
      </ul>
    </section>
  </div>`;
}

/** @param {string} id */
async function show(id) {
  await openBoard();
  await showLens(id).catch(notifyError);
}
