// English: every message of the page, by feature.
import common from "./en/common.js";
import core from "./en/core.js";
import canvas from "./en/canvas.js";
import ui from "./en/ui.js";
import areas from "./en/areas.js";
import board from "./en/board.js";
import calibrate from "./en/calibrate.js";
import calibrate_panels from "./en/calibrate_panels.js";
import check from "./en/check.js";
import compare from "./en/compare.js";
import detection from "./en/detection.js";
import drift from "./en/drift.js";
import field_editor from "./en/field_editor.js";
import help from "./en/help.js";
import jobs from "./en/jobs.js";
import lens_pictures from "./en/lens_pictures.js";
import library from "./en/library.js";
import live from "./en/live.js";
import markings from "./en/markings.js";
import network from "./en/network.js";
import referee from "./en/referee.js";
import rig from "./en/rig.js";
import rolling from "./en/rolling.js";
import scene from "./en/scene.js";
import settings from "./en/settings.js";
import shell from "./en/shell.js";
import straight from "./en/straight.js";
import verify from "./en/verify.js";
import versions from "./en/versions.js";

export default {
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
