"""A job's function found by its name and done, whatever comes of it: the same in a process and on a cluster."""

import math
import traceback
from importlib import import_module
from typing import Any

from app.core.errors import TouchlineError
from app.core.progress import Progress
from app.jobs.job import problem_of


def execute(run: str, spec: Any, progress: Progress) -> tuple[bool, Any]:
    """(True, what the function returned) or (False, its problem as JSON); run is "module:function".

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


def plain(value: object) -> object:
    """Plain JSON with None for what is not finite."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, (list, tuple)) else value
