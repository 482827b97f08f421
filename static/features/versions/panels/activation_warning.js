// What stands against a version, before it is activated all the same: asked at every place that activates one.
import { useEffect, useRef } from "preact/hooks";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { answerWarning, warning } from "../activate.js";

export const ActivationWarning = () =>
  warning.value ? html`<${Dialog} key=${warning.value} asked=${warning.value} />` : null;

/** @param {{ asked: import("../activate.js").Warning }} props */
function Dialog({ asked }) {
  const dialog = useRef(/** @type {HTMLDialogElement | null} */ (null)),
    close = () => answerWarning(asked, false);
  useEffect(() => {
    dialog.current?.showModal();
    addEventListener("hashchange", close); // whoever goes elsewhere is not asked again on coming back
    return () => removeEventListener("hashchange", close);
  }, []);
  return html`<dialog
    ref=${dialog}
    class="activation"
    role="alertdialog"
    data-testid="activation-warning"
    aria-labelledby="activation-title"
    aria-describedby="activation-problems"
    onClose=${close}
  >
    <h2 id="activation-title">${t("versions.warning.title", { version: asked.it.version ?? "" })}</h2>
    <ul id="activation-problems" class="plain">
      ${asked.claims.map(
        (claim) => html`<li key=${claim.code} data-testid=${`against-${claim.code}`}>
        <b>${claim.title}.</b>${" "}
        ${claim.evidence}
        ${" "}
        ${claim.fix}
      </li>`,
      )}
    </ul>
    <p class="dim">${t("versions.warning.consequence")}</p>
    <div class="line">
      <button type="button" data-testid="activate-cancel" onClick=${() => dialog.current?.close()}>
        ${t("common.cancel")}
      </button>
      <button
        type="button"
        class="anyway"
        data-testid="activate-anyway"
        onClick=${() => answerWarning(asked, true)}
      >
        ${t("versions.warning.activate-anyway")}
      </button>
    </div>
  </dialog>`;
}
