// Everything an operator can do, in one table by id. Toolbar, shortcuts, the bright button and the list of keys read
// it.

/**
 * @typedef {"model" | "pictures" | "points" | "view" | "compare" | "detection" | "field-editor" | "help" | "pages"
 *   | "places" | "steps"} Group
 */

/**
 * @typedef {object} Action
 * @property {string} id
 * @property {string} label what it does, beginning with a verb
 * @property {string} [short] the same on a small button
 * @property {string[]} [keys] as "p", "ctrl+z", "shift+ArrowUp"
 * @property {Group} [group] heading in the list of keys
 * @property {(event?: KeyboardEvent) => void} run
 * @property {() => boolean} [enabled]
 * @property {() => boolean} [pressed] for buttons that stay down
 */

/**
 * In the order of registration: of several actions with one key, the first that is enabled runs.
 * @type {Map<string, Action>}
 */
export const ACTIONS = new Map();

/** Add actions to the table, before anything is drawn. @param {Action[]} actions */
export function registerActions(actions) {
  for (const action of actions) ACTIONS.set(action.id, action);
}

/** Run an action, if it is enabled. @param {string} id @param {KeyboardEvent} [event] */
export function run(id, event) {
  const action = ACTIONS.get(id);
  if (action && (action.enabled?.() ?? true)) action.run(event);
}

/** The page's one file input; a browser opens its picker only from a click. */
export const filePicker = { open: () => {} };
