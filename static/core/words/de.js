// German: every message of the page, by feature, and what the server states, by code.
import common from "./de/common.js";
import core from "./de/core.js";
import canvas from "./de/canvas.js";
import ui from "./de/ui.js";
import areas from "./de/areas.js";
import board from "./de/board.js";
import calibrate from "./de/calibrate.js";
import calibrate_panels from "./de/calibrate_panels.js";
import check from "./de/check.js";
import compare from "./de/compare.js";
import detection from "./de/detection.js";
import drift from "./de/drift.js";
import field_editor from "./de/field_editor.js";
import help from "./de/help.js";
import jobs from "./de/jobs.js";
import lens_pictures from "./de/lens_pictures.js";
import library from "./de/library.js";
import live from "./de/live.js";
import markings from "./de/markings.js";
import network from "./de/network.js";
import referee from "./de/referee.js";
import rig from "./de/rig.js";
import rolling from "./de/rolling.js";
import scene from "./de/scene.js";
import settings from "./de/settings.js";
import shell from "./de/shell.js";
import straight from "./de/straight.js";
import verify from "./de/verify.js";
import versions from "./de/versions.js";
import statedInChecks from "./de/statements/checks.js";
import statedInClaims from "./de/statements/claims.js";
import statedOfFits from "./de/statements/fits.js";
import statedOfPoints from "./de/statements/points.js";
import statedOfCameras from "./de/statements/cameras.js";
import statedOfFiles from "./de/statements/files.js";
import statedInWorkflows from "./de/statements/workflows.js";
import statedInTables from "./de/statements/tables.js";

/** @type {Record<import("./types").Key, import("./types").Entry>} */
export const messages = {
  ...common,
  ...core,
  ...canvas,
  ...ui,
  ...areas,
  ...board,
  ...calibrate,
  ...calibrate_panels,
  ...check,
  ...compare,
  ...detection,
  ...drift,
  ...field_editor,
  ...help,
  ...jobs,
  ...lens_pictures,
  ...library,
  ...live,
  ...markings,
  ...network,
  ...referee,
  ...rig,
  ...rolling,
  ...scene,
  ...settings,
  ...shell,
  ...straight,
  ...verify,
  ...versions,
};

/** @type {Record<string, string>} */
export const statements = {
  ...statedInChecks,
  ...statedInClaims,
  ...statedInTables,
  ...statedInWorkflows,
  ...statedOfCameras,
  ...statedOfFiles,
  ...statedOfFits,
  ...statedOfPoints,
};
