// How high each team's robots are: by the game controller, by hand, and the table.
import { signal } from "@preact/signals";
import { address } from "../../../core/api.js";
import { number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { Title } from "../../../ui/title.js";
import { Typed } from "../../../ui/typed.js";
import { addHeights, changing, referee, setReferee } from "../referee.js";
import { HeightsUsed, TEAMS, nameOf } from "./heights_used.js";

/** @typedef {import("../types").Referee} Referee @typedef {{ target: HTMLInputElement & HTMLSelectElement }} Changed */

/** A new line of the table. */
const added = signal({ team: "", height: "" });
const LISTENING = {
  null: t("referee.listen.with-publishing"),
  true: t("referee.listen.on"),
  false: t("referee.listen.off"),
};

export function RobotHeights() {
  const it = referee.value;
  if (!it) return null;
  return html`<section class="network" data-testid="robot-heights" aria-label=${t("referee.title")}>
    <${Title} of="robot-heights">${t("referee.title")}<//>
    <${HeightsUsed} teams=${it.teams} />
    ${TEAMS.map((team) => html`<${ByHand} key=${team} it=${it} team=${team} />`)}
    <${GameController} it=${it} />
    <${Table} it=${it} />
  </section>`;
}

/** A team without a game controller. @param {{ it: Referee, team: import("../types").Team }} props */
function ByHand({ it, team }) {
  const { name, height_mm } = it[team];
  const isListed = name === null || it.table.some((one) => one.team === name);
  return html`<div class="way">
    <label>
      ${t("referee.by-hand.team", { team: nameOf(team) })}
      <select
        data-testid=${`team-${team}`}
        value=${name ?? ""}
        disabled=${changing.value}
        onChange=${(/** @type {Changed} */ { target }) =>
          void setReferee({ [team]: { name: target.value || null, height_mm } })}
      >
        <option value="">${t("referee.by-hand.game-controller")}</option>
        ${!isListed && html`<option value=${name}>${name}</option>`}
        ${it.table.map((one) => html`<option key=${one.team} value=${one.team}>${one.team}</option>`)}
      </select>
    </label>
    <label>
      ${t("referee.by-hand.height", { team: nameOf(team) })}
      <${Typed}
        type="number"
        min="10"
        step="any"
        placeholder=${t("referee.by-hand.by-table")}
        data-testid=${`height-${team}`}
        value=${height_mm ?? ""}
        take=${(/** @type {string} */ text) =>
          setReferee({ [team]: { name, height_mm: text === "" ? null : Number(text) } })}
      />
    </label>
  </div>`;
}

/** Whether and where it is listened to, and who is heard. @param {{ it: Referee }} props */
function GameController({ it }) {
  const chosen = it.controllers.find((one) => one.chosen);
  const known = it.interfaces.filter((i) => i.address !== null);
  const isListed = it.interface === "" || known.some((i) => i.name === it.interface);
  return html`<p data-testid="game-controller">
      <b>${t("referee.controller")}</b>${" "}
      ${
        chosen
          ? t(chosen.current ? "referee.controller.heard" : "referee.controller.silent", {
              address: chosen.address,
              age: number(chosen.age_s, 0),
            })
          : it.listening
            ? t("referee.controller.nobody")
            : it.problem
              ? `${it.problem.what} ${it.problem.fix}`
              : t("referee.controller.off")
      }
    </p>
    <div class="way">
      <label>
        ${t("referee.listen")}
        <select
          data-testid="referee-enabled"
          value=${String(it.enabled)}
          disabled=${changing.value}
          onChange=${(/** @type {Changed} */ { target }) =>
            void setReferee({ enabled: JSON.parse(target.value) })}
        >
          ${Object.entries(LISTENING).map(
            ([value, label]) => html`<option key=${value} value=${value}>${label}</option>`,
          )}
        </select>
      </label>
      <label>
        ${t("network.way.interface")}
        <select
          data-testid="referee-interface"
          value=${it.interface}
          disabled=${changing.value}
          onChange=${(/** @type {Changed} */ { target }) =>
            void setReferee({ interface: target.value })}
        >
          <option value="">${t("referee.same-interface")}</option>
          ${known.map(
            (i) => html`<option key=${i.name} value=${i.name}>${i.name}, ${i.address}</option>`,
          )}
          ${!isListed && html`<option value=${it.interface}>${it.interface}</option>`}
        </select>
      </label>
      <label>
        ${t("network.way.group")}
        <${Typed}
          type="text"
          data-testid="referee-group"
          value=${it.group}
          take=${(/** @type {string} */ text) => text && setReferee({ group: text.trim() })}
        />
      </label>
      <label>
        ${t("network.way.port")}
        <${Typed}
          type="number"
          data-testid="referee-port"
          value=${it.port}
          take=${(/** @type {string} */ text) => text && setReferee({ port: Number(text) })}
        />
      </label>
    </div>`;
}

/** Every team's height: own ones can be removed, any can be replaced. @param {{ it: Referee }} props */
function Table({ it }) {
  const { team, height } = added.value;
  const add = async (/** @type {Event} */ event) => {
    event.preventDefault();
    await setReferee({ heights: { [team.trim()]: Number(height) } });
    if (referee.value?.table.some((one) => one.own && one.team === team.trim()))
      added.value = { team: "", height: "" };
  };
  return html`<details class="more">
    <summary data-testid="heights-table">${t("referee.table", { count: it.table.length })}</summary>
    <div class="line wrap">
      <label class="as-button choose-field">
        ${t("referee.table.open")}
        <input
          type="file"
          class="sr"
          accept=".yml,.yaml"
          data-testid="heights-file"
          onChange=${(/** @type {Changed} */ { target }) => {
            const file = target.files?.[0];
            if (file) void addHeights(file);
            target.value = "";
          }}
        />
      </label>
      <a href=${address("/referee/robot-heights.yml")} download>${t("referee.table.save")}</a>
    </div>
    <form class="way" onSubmit=${add}>
      <label>
        ${t("referee.table.team")}
        <input
          type="text"
          required
          maxlength="64"
          data-testid="new-team"
          value=${team}
          onInput=${(/** @type {Changed} */ { target }) => {
            added.value = { team: target.value, height };
          }}
        />
      </label>
      <label>
        ${t("referee.table.height")}
        <input
          required
          type="number"
          min="10"
          max="2000"
          step="any"
          data-testid="new-height"
          value=${height}
          onInput=${(/** @type {Changed} */ { target }) => {
            added.value = { team, height: target.value };
          }}
        />
      </label>
      <button type="submit" disabled=${changing.value}>${t("referee.table.add")}</button>
    </form>
    <table class="heights">
      <thead>
        <tr>
          <th>${t("referee.table.team")}</th>
          <th>${t("referee.table.height")}</th>
          <th></th>
        </tr>
      </thead>
      <tbody>
        ${it.table.map(
          (one) => html`<tr key=${one.team} data-testid="height-row">
          <th>${one.team}</th>
          <td>
            <${Typed}
              type="number"
              min="10"
              step="any"
              aria-label=${t("referee.table.height-of", { team: one.team })}
              value=${one.height_mm}
              take=${(/** @type {string} */ text) =>
                text && setReferee({ heights: { [one.team]: Number(text) } })}
            />
          </td>
          <td>
            ${
              one.own &&
              html`<button
              type="button"
              disabled=${changing.value}
              aria-label=${t("referee.table.remove-of", { team: one.team })}
              onClick=${() => void setReferee({ heights: { [one.team]: null } })}
            >
              ${t("referee.table.remove")}
            </button>`
            }
          </td>
        </tr>`,
        )}
      </tbody>
    </table>
  </details>`;
}
