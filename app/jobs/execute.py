"""A job's function, found by its name and called, whatever comes of it: the same in a process and on a cluster."""

import traceback
from importlib import import_module
from typing import Any

from app.core.errors import TouchlineError
from app.core.jobs import problem_of
from app.core.progress import Progress

LEGACY_NAMES = {  # names that jobs were stored with by earlier versions
    "app.task:run_fit": "app.workflows.calibration_request:run_fit",
    "app.task:run_compare": "app.workflows.calibration_request:run_compare",
    "app.board_task:run_views": "app.workflows.board_request:run_views",
    "app.board_task:run_pictures": "app.workflows.board_request:run_pictures",
    "app.pair_pipeline:run_pair": "app.workflows.pair:run_pair",
    "app.plumb_task:run_straightness": "app.workflows.straight_lines_request:run_straightness",
    "app.rig_pipeline:run_check": "app.workflows.rig:run_check",
    "app.rig_pipeline:run_refit": "app.workflows.refit:run_refit",
    "app.auto_task:run_auto": "app.workflows.recognition:run_auto",
    "app.workflows.automatic_request:run_auto": "app.workflows.recognition:run_auto",
    "app.motion_task:run_motion": "app.workflows.rolling_request:run_motion",
    "app.check_pipeline:run_check": "app.workflows.check:run_check",
    "app.register_task:run_register": "app.workflows.reregister:run_register",
}


def current_name(run: str) -> str:
    """Return the name that a job's function has in this version."""
    return LEGACY_NAMES.get(run, run)


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
