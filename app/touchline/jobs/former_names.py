"""The names with which earlier versions stored jobs: a function in its module, within the package of that time."""

PACKAGES = ("app.", "touchline.")
FORMER_NAMES = {
    "auto_task:run_auto": "automatic.detect",
    "board_task:run_pictures": "board.pictures",
    "board_task:run_views": "board.views",
    "check_pipeline:run_check": "drift.check",
    "motion_task:run_motion": "straight.rolls",
    "pair_pipeline:run_pair": "rig.pair",
    "plumb_task:run_straightness": "straight.measure",
    "register_task:run_register": "drift.reregister",
    "rig_pipeline:run_check": "rig.check",
    "rig_pipeline:run_refit": "calibration.refit",
    "task:run_compare": "calibration.compare",
    "task:run_fit": "calibration.fit",
    "workflows.automatic_request:run_auto": "automatic.detect",
    "workflows.board_request:run_pictures": "board.pictures",
    "workflows.board_request:run_views": "board.views",
    "workflows.calibration_request:run_compare": "calibration.compare",
    "workflows.calibration_request:run_fit": "calibration.fit",
    "workflows.check:run_check": "drift.check",
    "workflows.pair:run_pair": "rig.pair",
    "workflows.recognition:run_auto": "automatic.detect",
    "workflows.refit:run_refit": "calibration.refit",
    "workflows.reregister:run_register": "drift.reregister",
    "workflows.rig:run_check": "rig.check",
    "workflows.rolling_request:run_motion": "straight.rolls",
    "workflows.straight_lines_request:run_straightness": "straight.measure",
}


def current_name(stored: str) -> str:
    """Return the name that a stored job has in this version."""
    for package in PACKAGES:
        if stored.startswith(package):
            return FORMER_NAMES.get(stored.removeprefix(package), stored)
    return stored
