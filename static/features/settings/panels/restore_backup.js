// The way back from damaged data: the newest good backup, once it is said in words what that costs.
import { dayAndTime } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import {
  canRestore,
  findRestoration,
  forgetRestoration,
  restoration,
  restoreBackup,
} from "../restoring.js";

export function RestoreBackup() {
  const it = restoration.value;
  if (!canRestore.value) return null;
  if (!it)
    return html`<p>
      <button type="button" data-testid="find-backup" onClick=${() => void findRestoration()}>
        ${t("settings.restore.find")}
      </button>
    </p>`;
  return html`<div class="warning-line" role="alert" data-testid="restoration">
    <b>${t("settings.restore.backup", { time: dayAndTime(it.made_at), number: it.backup })}</b>${" "}
    ${t("settings.restore.lost", { count: it.lost })}${" "}
    ${t("settings.restore.kept")}
    <div class="line">
      <button type="button" data-testid="restore-cancel" onClick=${forgetRestoration}>
        ${t("common.cancel")}
      </button>
      <button type="button" class="anyway" data-testid="restore-backup" onClick=${() => void restoreBackup(it)}>
        ${t("settings.restore.do")}
      </button>
    </div>
  </div>`;
}
