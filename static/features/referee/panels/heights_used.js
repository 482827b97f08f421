// Which height each team's robots have, and why.
import { capitalised, number } from "../../../core/format.js";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";

/** @typedef {import("../types").Team} Team @typedef {import("../types").TeamHeight} TeamHeight */

/** @type {readonly Team[]} */
export const TEAMS = ["blue", "yellow"];
const NAMES = { blue: t("detection.colour.blue"), yellow: t("detection.colour.yellow") };
const SOURCES = {
  hand: t("referee.used.by-hand"),
  "game-controller": t("referee.used.by-game-controller"),
};

/** @param {Team} team */
export const nameOf = (team) => NAMES[team];

/** With a decimal only where there is one. @param {number} height */
export const shortest = (height) => number(height, Number.isInteger(height) ? 0 : 1);

/** @param {TeamHeight} it */
export function heightUsed({ team, entry, height_mm, source, known }) {
  const height = height_mm === null ? "" : t("referee.used.mm", { height: shortest(height_mm) });
  if (known && source) {
    const name = entry !== null && entry !== team ? `${team} (${entry})` : team;
    return [name, height, SOURCES[source]].filter(Boolean).join(", ");
  }
  const field = [height, t("referee.used.field")].filter(Boolean).join(", ");
  return source ? `${t("referee.used.unknown", { team: team ?? "" })} ${field}` : field;
}

/** Both teams, a line each. @param {{ teams: Record<Team, TeamHeight> }} props */
export const HeightsUsed = ({
  teams,
}) => html`<ul class="plain heights-used" data-testid="heights-used">
  ${TEAMS.map(
    (team) => html`<li key=${team} data-testid=${`height-of-${team}`}>
    <i class="dot" data-team=${team} aria-hidden="true"></i>
    <b>${capitalised(nameOf(team))}:</b>${" "}
     ${heightUsed(teams[team])}
  </li>`,
  )}
</ul>`;
