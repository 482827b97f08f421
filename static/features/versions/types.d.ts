// Saved versions, and what was active when.
export type { Activation, Difference as VersionDifference } from "../../core/rest";
export type { Calibration as VersionRecord } from "../../core/types";
