// GET /jobs.
import type { Job } from "../../core/types";

/** A job as the list of all has it. made: ids of what it has kept. */
export interface JobInList extends Job { made: { calibration?: string; lens?: string }; created_at: string; ended_at: string | null }
