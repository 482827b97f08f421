// What is wrong with a version, before it is activated all the same.
import { useEffect, useRef } from "preact/hooks";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { version } from "../../versions/versions.js";
import { activateAnyway, closeWarning, openWarning } from "../actions.js";
import { problems } from "../checks.js";

export const ActivationWarning = () =>
  openWarning.value ? html`<${Warning} key=${openWarning.value} warning=${openWarning.value} />` : null;

/** @param {{ warning: { of: string } }} props */
function Warning({ warning }) {
  const dialog = useRef(/** @type {HTMLDialogElement | null} */ (null)),
    close = () => closeWarning(warning);
  useEffect(() => {
    dialog.current?.showModal();
    return close; // whoever goes elsewhere is not asked again on coming back
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
    <h2 id="activation-title">${t("verify.warning.title", { version: version.value?.version ?? "" })}</h2>
    <ul id="activation-problems" class="plain">
      ${problems.value.map((c) => html`<li key=${c.id}>
        <b>${c.title}.</b>${" "}
        ${c.text}
        ${" "}
        ${c.fix}
      </li>`)}
    </ul>
    <p class="dim">${t("verify.warning.consequence")}</p>
    <div class="line">
      <button type="button" data-testid="activate-cancel" onClick=${() => dialog.current?.close()}>
        ${t("common.cancel")}
      </button>
      <button type="button" class="anyway" data-testid="activate-anyway" onClick=${() => void activateAnyway()}>
        ${t("verify.warning.activate-anyway")}
      </button>
    </div>
  </dialog>`;
}
