// Every feature's actions in one order: that of the list of keys, and of which action a shared key means first.
import { BOARD_ACTIONS } from "../board/actions.js";
import { FIND_LINES_ACTIONS } from "../calibrate/find_lines.js";
import { MODEL_ACTIONS } from "../calibrate/model_actions.js";
import { FIELD_ACTIONS, PICTURE_ACTIONS } from "../calibrate/picture_actions.js";
import { HISTORY_ACTIONS, POINT_ACTIONS } from "../calibrate/point_actions.js";
import { SNAP_ACTIONS } from "../calibrate/snap_actions.js";
import { VIEW_ACTIONS } from "../calibrate/view_actions.js";
import { CHECK_ACTIONS } from "../check/check.js";
import { COMPARE_ACTIONS } from "../compare/actions.js";
import { MAP_ACTIONS } from "../compare/map_actions.js";
import { DETECTION_ACTIONS } from "../detection/actions.js";
import { DRIFT_ACTIONS } from "../drift/drift.js";
import { FIELD_EDITOR_ACTIONS } from "../field_editor/actions.js";
import { HELP_ACTIONS } from "../help/actions.js";
import { LIVE_ACTIONS } from "../live/actions.js";
import { RIG_ACTIONS } from "../rig/actions.js";
import { MATCH_ACTIONS, actingOnMatches } from "../rig/match_actions.js";
import { TRACK_ACTIONS } from "../rig/tracks.js";
import { ROLLING_ACTIONS } from "../rolling/actions.js";
import { SCENE_ACTIONS } from "../scene/actions.js";
import { STRAIGHT_ACTIONS } from "../straight/actions.js";
import { VERIFY_ACTIONS } from "../verify/actions.js";
import { VERSION_ACTIONS } from "../versions/actions.js";
import { PAGE_ACTIONS } from "./page_actions.js";
import { STEP_ACTIONS } from "./step_actions.js";

/** @type {import("../../core/actions.js").Action[]} */
export const ACTION_TABLE = [
  FIELD_EDITOR_ACTIONS,
  PICTURE_ACTIONS,
  LIVE_ACTIONS,
  BOARD_ACTIONS,
  PAGE_ACTIONS,
  RIG_ACTIONS,
  MATCH_ACTIONS,
  STRAIGHT_ACTIONS,
  FIELD_ACTIONS,
  DETECTION_ACTIONS,
  POINT_ACTIONS,
  SNAP_ACTIONS,
  SCENE_ACTIONS,
  ROLLING_ACTIONS,
  FIND_LINES_ACTIONS,
  CHECK_ACTIONS,
  TRACK_ACTIONS,
  DRIFT_ACTIONS,
  HISTORY_ACTIONS,
  VIEW_ACTIONS,
  COMPARE_ACTIONS,
  MAP_ACTIONS,
  MODEL_ACTIONS,
  STEP_ACTIONS,
  VERSION_ACTIONS,
  VERIFY_ACTIONS,
  HELP_ACTIONS,
]
  .flat()
  .map(actingOnMatches);
