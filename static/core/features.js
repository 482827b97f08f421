// What the page consists of: the features that main.js registers, before anything is drawn.
import { registerActions } from "./actions.js";
import { registerAddresses } from "./route.js";

/**
 * @typedef {import("./actions.js").Action} Action
 * @typedef {import("@preact/signals").ReadonlySignal<{ action: string, label: string, missing: string, done: boolean,
 * sentence: string }>} NextStep
 */

/**
 * What a view shows. Without Main the stage is in the middle, as while calibrating.
 * @typedef {object} Shown
 * @property {string[]} addresses the fuller one first; their first word is the place of the rail
 * @property {string} label
 * @property {any} [Main] in the middle
 * @property {any} [Form] at the left
 * @property {any} [Report] on the right
 * @property {import("@preact/signals").ReadonlySignal<boolean>} [hasPanels] whether there is anything for either side
 * @property {NextStep} [nextStep] a list has none
 * @property {(files: FileList) => unknown} [add] takes files that are opened, dropped or pasted there; elsewhere a
 * picture is opened
 * @property {Partial<Record<import("./route.js").Place, number>>} [tabs] its tab's rank among those of a place
 * @property {string} [tab] what the tab says, where that is not the label
 * @property {string} [behind] the view whose tab is shown for it
 */

/**
 * What one folder of features/ adds to the page. V: the names of its views.
 * @template {string} [V=never]
 * @typedef {object} Feature
 * @property {Action[]} [actions]
 * @property {(action: Action) => Action} [adapt] what an action of any feature means in a view of this one
 * @property {(() => void)[]} [start] run once, when the page is drawn
 * @property {Record<V, Shown>} [views]
 * @property {Record<string, string>} [jobs] what its kinds of jobs are called
 */

/** @type {Map<string, Shown>} */
export const VIEWS = new Map();
/** What a kind of job is called. @type {Record<string, string>} */
export const KINDS = {};

/** Add the features in their order. @param {readonly Feature<string>[]} features */
export function registerFeatures(features) {
  const adapt = features.flatMap((it) => it.adapt ?? []);
  for (const { actions = [], views = {}, jobs = {} } of features) {
    registerActions(actions.map((action) => adapt.reduce((it, change) => change(it), action)));
    for (const [name, view] of Object.entries(views)) VIEWS.set(name, view);
    Object.assign(KINDS, jobs);
  }
  registerAddresses(
    [...VIEWS].flatMap(([view, { addresses }]) =>
      addresses.map((it) => /** @type {[import("./route.js").View, string]} */ ([view, it])),
    ),
  );
}
