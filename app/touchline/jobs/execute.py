"""A job's function, found by its name and called, whatever comes of it: the same in a process and on a cluster."""

import traceback
from importlib import import_module
from typing import Any

from touchline.core.errors import TouchlineError
from touchline.core.jobs import problem_of
from touchline.core.progress import Progress

LEGACY_PACKAGE = "app."  # what the import package was called
LEGACY_NAMES = {  # names that jobs were stored with by earlier versions, within the package
    "task:run_fit": "workflows.calibration_request:run_fit",
    "task:run_compare": "workflows.calibration_request:run_compare",
    "board_task:run_views": "workflows.board_request:run_views",
    "board_task:run_pictures": "workflows.board_request:run_pictures",
    "pair_pipeline:run_pair": "workflows.pair:run_pair",
    "plumb_task:run_straightness": "workflows.straight_lines_request:run_straightness",
    "rig_pipeline:run_check": "workflows.rig:run_check",
    "rig_pipeline:run_refit": "workflows.refit:run_refit",
    "auto_task:run_auto": "workflows.recognition:run_auto",
    "workflows.automatic_request:run_auto": "workflows.recognition:run_auto",
    "motion_task:run_motion": "workflows.rolling_request:run_motion",
    "check_pipeline:run_check": "workflows.check:run_check",
    "register_task:run_register": "workflows.reregister:run_register",
}


def current_name(run: str) -> str:
    """Return the name that a job's function has in this version."""
    if not run.startswith(LEGACY_PACKAGE):
        return run
    name = run.removeprefix(LEGACY_PACKAGE)
    return f"touchline.{LEGACY_NAMES.get(name, name)}"


def execute(run: str, spec: Any, progress: Progress) -> tuple[bool, Any]:
    """Return (True, what the function returned) or (False, its problem as JSON); run is "module:function".

    Nothing is raised: an exception of ours, or of a library, may not be one that the server can read.
    """
    try:
        module, _, name = run.partition(":")
        return True, getattr(import_module(module), name)(spec, progress)
    except TouchlineError as error:
        return False, problem_of(error)
    except MemoryError:
        return False, {"reason": "job-needs-memory"}
    except (Exception, SystemExit):
        return False, {"reason": "unexpected", "trace": traceback.format_exc()[-4000:]}
