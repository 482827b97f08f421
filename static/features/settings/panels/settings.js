// The server's settings, its disk usage, and this browser's preferences.
import { useEffect } from "preact/hooks";
import { address } from "../../../core/api.js";
import { ago, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { MAX_NAME_LENGTH } from "../../../core/operator.js";
import { addressOf } from "../../../core/route.js";
import { LANGUAGES, chooseLanguage, chosenLanguage, nameOr, t } from "../../../core/words.js";
import { CHOICES, choice, chooseCorrection, correctionWords } from "../../../canvas/graphics.js";
import { Typed } from "../../../ui/typed.js";
import { problems } from "../../shell/problems.js";
import {
  chooseName,
  fetchSettings,
  forgetPreferences,
  health,
  isGuarded,
  operatorName,
  serverSettings,
} from "../settings.js";
import { RestoreBackup } from "./restore_backup.js";

/** @typedef {import("../types").Setting} Setting */

const MB = 1e6;
const GENERAL = "general"; // the section of settings that name none
/** Where what can be changed while the server runs is changed.
 * @type {Record<string, [import("../../../core/route.js").View, string]>} */
const CHANGE = {
  cameras: ["wall", t("settings.change.cameras")],
  network: ["publishing", t("settings.change.network")],
};

export function SettingsPage() {
  useEffect(() => {
    void fetchSettings();
  }, []);
  const it = serverSettings.value;
  return html`<div class="page" data-testid="settings-page">
    <h1>${t("settings.server")}</h1>
    <${Health} />
    <${Preferences} />
    ${
      it &&
      html`
      <${Storage} room=${it.storage} />
      <${Server} items=${it.items} />
    `
    }
  </div>`;
}

function Health() {
  const it = health.value,
    here = problems.value.filter(({ place }) => place === "system"),
    elsewhere = problems.value.find(({ place }) => place !== "system");
  if (!it) return null;
  return html`<section aria-label=${t("settings.health.title")}>
    <h2>${t("settings.health.title")}</h2>
    <p data-testid="health" data-count=${problems.value.length}>
      ${
        problems.value.length === 0 && html`<b class="level good">${t("settings.health.good")}</b>`
      }${" "}
      ${t("settings.health.version", { version: it.version, time: span(it.uptime_s) })}
    </p>
    ${
      here.length > 0 &&
      html`<ul class="warnings" data-testid="health-warnings">
      ${here.map(
        ({ id, text, fix }) => html`<li key=${id}>
        <b>${text}</b> ${fix}
      </li>`,
      )}
    </ul>`
    }
    ${
      elsewhere &&
      html`<p data-testid="health-elsewhere">
      ${t("settings.health.elsewhere", { count: problems.value.length - here.length })}${" "}
      <b>${elsewhere.text}</b>${" "}
      ${elsewhere.href && html`<a href=${elsewhere.href}>${t("common.show-it")}</a>`}
    </p>`
    }
    <${RestoreBackup} />
  </section>`;
}

/** @param {number} s */
const span = (s) =>
  s < 120
    ? `${number(s, 0)} s`
    : s < 7200
      ? `${number(s / 60, 0)} min`
      : s < 172_800
        ? `${number(s / 3600, 0)} h`
        : t("settings.days", { days: number(s / 86_400, 0) });

function Preferences() {
  return html`<section aria-label=${t("settings.browser.title")}>
    <h2>${t("settings.browser.title")}</h2>
    <label class="pair tall">
      <span>${t("settings.browser.name")}</span>
      <${Typed}
        type="text"
        data-testid="operator-name"
        maxlength=${MAX_NAME_LENGTH}
        autocomplete="name"
        placeholder=${t("settings.browser.name.placeholder")}
        value=${operatorName.value}
        take=${chooseName}
      />
    </label>
    <label class="pair">
      <span>${t("settings.browser.language")}</span>
      <select
        data-testid="language"
        value=${chosenLanguage()}
        onChange=${(/** @type {Event} */ e) => chooseLanguage(/** @type {HTMLSelectElement} */ (e.target).value)}
      >
        <option value="">${t("settings.browser.language.browser")}</option>
        ${LANGUAGES.map(
          (id) => html`<option key=${id} value=${id} lang=${id}>
          ${t(`settings.browser.language.${id}`)}
        </option>`,
        )}
      </select>
    </label>
    <label class="pair">
      <span>${t("settings.browser.correction")}</span>
      <select
        data-testid="correction"
        value=${choice.value}
        onChange=${(/** @type {Event} */ e) =>
          chooseCorrection(/** @type {any} */ (/** @type {HTMLSelectElement} */ (e.target).value))}
      >
        ${CHOICES.map(
          ([id, name]) => html`<option key=${id} value=${id}>
          ${name}
        </option>`,
        )}
      </select>
    </label>
    <p class="reason" data-testid="correction-now">${correctionWords.value}</p>
    <div class="line">
      <button type="button" data-testid="forget-preferences" onClick=${forgetPreferences}>
        ${t("settings.browser.forget")}
      </button>
      <small class="grow">
        ${t("settings.browser.forget.what")}
      </small>
    </div>
    ${
      isGuarded.value &&
      html`<form class="line" method="post" action="/logout">
      <button data-testid="sign-out">${t("settings.browser.sign-out")}</button>
      <small class="grow">${t("settings.browser.sign-out.what")}</small>
    </form>`
    }
  </section>`;
}

/** @param {{ room: import("../types").DiskUsage }} props */
function Storage({ room }) {
  const { backups } = room;
  return html`<section aria-label=${t("settings.storage.title")}>
    <h2>${t("settings.storage.title")}</h2>
    <${Taken}
      name="pictures"
      what=${t("settings.storage.pictures")}
      used=${room.pictures_bytes}
      limit=${room.pictures_limit_bytes}
    />
    ${
      backups &&
      html`<${Taken}
      name="backups"
      what=${t("settings.storage.backups", { count: backups.count })}
      used=${backups.used_bytes}
      limit=${backups.limit_bytes}
    />`
    }
    <dl class="details">
      <div>
        <dt>${t("settings.storage.free")}</dt>
        <dd>${size(room.free_bytes)}</dd>
      </div>
      ${
        room.database_bytes !== null &&
        html`<div>
        <dt>${t("settings.storage.database")}</dt>
        <dd>${size(room.database_bytes)}</dd>
      </div>`
      }
      <div>
        <dt>${t("settings.storage.newest")}</dt>
        <dd data-testid="newest-backup">
          ${
            !backups
              ? t("settings.storage.newest.database")
              : backups.newest_at
                ? ago(Date.parse(backups.newest_at), Date.now())
                : t("settings.storage.newest.none")
          }
        </dd>
      </div>
      ${
        room.replaced.length > 0 &&
        html`<div>
        <dt>${t("settings.storage.replaced")}</dt>
        <dd data-testid="replaced">${room.replaced.join(", ")}</dd>
      </div>`
      }
    </dl>
    <p class="reason">${t("settings.storage.about")}</p>
    <p>
      <a data-testid="download-everything" href=${address("/archive")} download>
        ${t("settings.storage.download")}
      </a>
    </p>
  </section>`;
}

/** @param {{ name: string, what: string, used: number, limit: number }} props */
const Taken = ({
  name,
  what,
  used,
  limit,
}) => html`<div class="taken" data-testid=${`taken-${name}`}>
  <div class="line">
    <span class="grow">${what}</span>
    <b>${size(used)}</b>
    <small>${t("settings.storage.limit", { limit: size(limit) })}</small>
  </div>
  <progress max="1" value=${Math.min(1, used / limit)} aria-label=${what}></progress>
</div>`;

/** @param {number} bytes */
const size = (bytes) =>
  bytes >= 1000 * MB
    ? `${number(bytes / 1000 / MB, 1)} GB`
    : `${number(bytes / MB, bytes < 10 * MB ? 1 : 0)} MB`;

/** @param {{ items: Setting[] }} props */
function Server({ items }) {
  const sections = [...new Set(items.map(sectionOf))];
  return html`<section aria-label=${t("settings.server")}>
    <h2>${t("settings.server")}</h2>
    <p class="reason">${t("settings.server.about")}</p>
    ${sections.map(
      (section) => html`<details
      key=${section}
      class="more settings"
      open=${items.some((s) => sectionOf(s) === section && !isDefault(s))}
      data-testid=${`section-${section}`}
    >
      <summary>${sectionTitle(section)}</summary>
      <dl>
        ${items
          .filter((s) => sectionOf(s) === section)
          .map(
            (s) => html`<div key=${s.name} data-testid=${`setting-${s.name}`}>
            <dt>
              <code>${s.name}</code> <b>${shown(s)}</b>
              ${
                !isDefault(s) &&
                !s.secret &&
                html`
                ${" "}
                <small>${t("settings.value.default", { value: plain(s.default) })}</small>
              `
              }
            </dt>
            <dd>
              <small>${s.help}</small>
              ${
                s.change &&
                html`
                ${" "}
                <a href=${addressOf(CHANGE[s.change][0])}>${CHANGE[s.change][1]}</a>
              `
              }
            </dd>
          </div>`,
          )}
      </dl>
    </details>`,
    )}
  </section>`;
}

/** @param {Setting} s */
const sectionOf = ({ name }) => (name.includes(".") ? name.split(".")[0] : GENERAL);
/** @param {string} section */
const sectionTitle = (section) => nameOr(`settings.section.${section}`, section);
/** @param {Setting} s */
const isDefault = (s) => JSON.stringify(s.value) === JSON.stringify(s.default);
/** @param {Setting} s */
const shown = (s) =>
  s.secret
    ? s.value === null
      ? t("settings.value.not-set")
      : t("settings.value.set")
    : plain(s.value);
/** @param {unknown} value @returns {string} */
const plain = (value) =>
  value === null
    ? t("settings.value.not-set")
    : value === ""
      ? t("settings.value.empty")
      : Array.isArray(value)
        ? value.join(", ") || t("settings.value.none")
        : typeof value === "boolean"
          ? value
            ? t("settings.value.on")
            : t("settings.value.off")
          : String(value);
