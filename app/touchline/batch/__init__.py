"""An archive of pictures, each calibrated or checked by a job of its own, and one table of what came out.

    requests.py      a folder → its pictures and the clicks beside each → what the job of each is given, or at once a
                     row that says why there is none
    scheduler.py     jobs, never more at once than the engine lets wait; rows as they end
    tasks.py         what a job does: it calibrates, or verifies
    verification.py  how well a calibration holds on another picture
    table.py         rows → CSV, JSON or HTML, from which a later run takes over what is the same
"""

from touchline.batch.requests import BatchPlan, pictures_in
from touchline.batch.scheduler import run_requests
from touchline.batch.table import SUFFIXES, Row, count_verdicts, encode_table, read_table

__all__ = ["SUFFIXES", "BatchPlan", "Row", "count_verdicts", "encode_table", "pictures_in", "read_table",
           "run_requests"]
