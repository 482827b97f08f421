"""A job's function, found by its name and called, whatever comes of it: the same in a process and on a cluster."""

import traceback
from typing import Any

from touchline.core.errors import TouchlineError
from touchline.core.jobs import Progress, problem_of
from touchline.core.registry import load


def execute(run: str, spec: Any, progress: Progress) -> tuple[bool, Any]:
    """Return (True, what the function returned) or (False, its problem as JSON); run is "module:function".

    Nothing is raised: an exception of ours, or of a library, may not be one that the server can read.
    """
    try:
        return True, load(run)(spec, progress)
    except TouchlineError as error:
        return False, problem_of(error)
    except MemoryError:
        return False, {"reason": "job-needs-memory"}
    except (Exception, SystemExit):
        return False, {"reason": "unexpected", "trace": traceback.format_exc()[-4000:]}
