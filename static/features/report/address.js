// Where the server has the report of a version: a page of its own, to print or to keep.
import { address } from "../../core/api.js";

/** @param {string} calibration its id */
export const reportAddress = (calibration) => address(`/calibrations/${calibration}/report.html`);
