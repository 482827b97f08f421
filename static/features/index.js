// The one list of features. Its order is that of the list of keys, and of which action a shared key means first.
import { automatic } from "./automatic/index.js";
import { board } from "./boards/index.js";
import { calibrate } from "./calibrate/index.js";
import { check } from "./check/index.js";
import { compare } from "./compare/index.js";
import { detection } from "./detection/index.js";
import { drift } from "./drift/index.js";
import { fields } from "./fields/index.js";
import { help } from "./help/index.js";
import { jobs } from "./jobs/index.js";
import { network } from "./league/index.js";
import { library } from "./library/index.js";
import { live } from "./live/index.js";
import { referee } from "./referee/index.js";
import { rig } from "./rigs/index.js";
import { scene } from "./scene/index.js";
import { settings } from "./settings/index.js";
import { shell } from "./shell/index.js";
import { straight } from "./straight/index.js";
import { verify } from "./verify/index.js";
import { versions } from "./versions/index.js";

export const FEATURES = /** @type {const} */ ([
  fields,
  calibrate.pictures,
  live,
  board,
  shell.places,
  rig.rigs,
  rig.matches,
  straight.edges,
  calibrate.field,
  detection,
  calibrate.points,
  scene,
  straight.rolls,
  automatic,
  check,
  rig.tracks,
  drift,
  calibrate.history,
  compare,
  calibrate.models,
  shell.steps,
  versions,
  verify,
  help,
  jobs,
  library,
  network,
  referee,
  settings,
]);

/**
 * @template F
 * @typedef {F extends import("../core/features.js").Feature<infer V extends string> ? V : never} ViewsOf
 */
/** @typedef {ViewsOf<(typeof FEATURES)[number]>} View */
