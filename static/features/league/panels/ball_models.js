// The ball models that are sent: entered, read from a file of the league's programs, or copied from another publisher.
import { signal } from "@preact/signals";
import { html } from "../../../core/html.js";
import { t } from "../../../core/words.js";
import { Typed } from "../../../ui/typed.js";
import { changing, readBallModels, receivedGeometry, setPublishing } from "../network.js";

/** @typedef {import("../types").BallModels} BallModels */
/** @typedef {"straight_two_phase" | "chip_fixed_loss"} Part */

/** The values of each part, as the packet and as people call them. @type {[Part, string, Record<string, string>][]} */
const PARTS = [
  [
    "straight_two_phase",
    t("network.ball.straight-two-phase"),
    {
      acc_slide: t("network.ball.acc-slide"),
      acc_roll: t("network.ball.acc-roll"),
      k_switch: t("network.ball.k-switch"),
    },
  ],
  [
    "chip_fixed_loss",
    t("network.ball.chip-fixed-loss"),
    {
      damping_xy_first_hop: t("network.ball.damping-xy-first-hop"),
      damping_xy_other_hops: t("network.ball.damping-xy-other-hops"),
      damping_z: t("network.ball.damping-z"),
    },
  ],
];
/** What was entered of a part that has not all its values yet. */
const entered = signal(/** @type {Record<string, string>} */ ({}));

/** @param {{ models: BallModels | null }} props */
export function BallModelSettings({ models }) {
  const others = (receivedGeometry.value?.items ?? []).filter((sender) => sender.ball_models);
  const set = (/** @type {BallModels | null} */ wanted) => {
    entered.value = {};
    return setPublishing({ ball_models: wanted });
  };
  return html`<details class="more" data-testid="ball-models">
    <summary>${t("network.ball")}</summary>
    <p class="reason">${t("network.ball.about")}</p>
    ${PARTS.map(
      ([part, title, names]) => html`<fieldset key=${part}>
      <legend>${title}</legend>
      <div class="way">
        ${Object.entries(names).map(
          ([name, label]) => html`<label key=${name}>
          ${label}
          <${Typed}
            type="number"
            step="any"
            data-testid=${`ball-${name}`}
            disabled=${changing.value}
            value=${entered.value[name] ?? models?.[part]?.[name] ?? ""}
            take=${(/** @type {string} */ text) => takeValue(models, part, Object.keys(names), name, text)}
          />
        </label>`,
        )}
      </div>
    </fieldset>`,
    )}
    <div class="line wrap">
      <label class="as-button">
        ${t("network.ball.file")}
        <input
          type="file"
          class="sr"
          data-testid="ball-file"
          accept=".xml,.yml,.yaml,.pb"
          onChange=${async (/** @type {{ target: HTMLInputElement }} */ { target }) => {
            const file = target.files?.[0];
            target.value = "";
            const found = file && (await readBallModels(file));
            if (found) await set(found);
          }}
        />
      </label>
      ${others.map(
        (sender) => html`<button
        key=${sender.id}
        type="button"
        data-testid=${`ball-copy-${sender.id}`}
        disabled=${changing.value}
        onClick=${() => void set(sender.ball_models)}
      >
        ${t("network.ball.copy", { sender: sender.address })}
      </button>`,
      )}
      ${
        models &&
        html`<button
        type="button"
        data-testid="ball-clear"
        disabled=${changing.value}
        onClick=${() => void set(null)}
      >
        ${t("network.ball.clear")}
      </button>`
      }
    </div>
  </details>`;
}

/**
 * Take one value; a part is sent once it has all of them, and no more once it has none.
 * @param {BallModels | null} models
 * @param {Part} part
 * @param {string[]} names
 * @param {string} name
 * @param {string} text
 */
async function takeValue(models, part, names, name, text) {
  entered.value = { ...entered.value, [name]: text };
  const values = names.map((each) => entered.value[each] ?? `${models?.[part]?.[each] ?? ""}`);
  const given = values.filter((value) => value !== "").length;
  if (given > 0 && given < names.length) return;
  const whole = given
    ? Object.fromEntries(names.map((each, i) => [each, Number(values[i])]))
    : null;
  const none = { straight_two_phase: null, chip_fixed_loss: null };
  await setPublishing({ ball_models: { ...none, ...models, [part]: whole } });
  entered.value = Object.fromEntries(
    Object.entries(entered.value).filter(([each]) => !names.includes(each)),
  );
}
