// English: the check of a calibration against the current image.
export default /** @type {const} */ ({
  "check.action.check": "Check the active calibration against the current image",
  "check.action.check.short": "Check the calibration",
  "check.action.stop": "Stop checking the calibration",
  "check.checking": "Checking the calibration",
  "check.not-told": "Inconclusive",
  "check.picture": "Checked image",
  "check.picture.caption": "White: lines at their positions in version {version}. Coloured: detected lines, red where more than {limit} mm off.",
  "check.picture.lines": "Calibrated and detected positions of the field lines",
  "check.table.explained": "mm: distance (rms) of the detected line from its position in version {version}, measured across the line on the carpet.",
  "check.table.found": "Detected",
  "check.table.line": "Line",
  "check.table.worst": "Largest",
  "check.title": "Calibration check",
  "check.what-it-does": "Compares the active version with the current image. Shows how far each field line is from its calibrated position.",
});
