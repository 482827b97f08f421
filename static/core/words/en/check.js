// English: the check of a calibration against the picture of now.
export default /** @type {const} */ ({
  "check.action.check": "Check the active calibration against the picture of now",
  "check.action.check.short": "Check the calibration",
  "check.action.stop": "Stop checking the calibration",
  "check.checking": "Checking the calibration",
  "check.not-told": "Not told",
  "check.picture": "The picture that was checked",
  "check.picture.caption": "White: where version {version} has the lines. Coloured: where they are; more than {limit} mm off in red.",
  "check.picture.lines": "Where the calibration has the lines, and where they are",
  "check.table.explained": "mm: how far the line lies from where version {version} has it, across it on the carpet.",
  "check.table.found": "found",
  "check.table.line": "Line",
  "check.table.worst": "worst",
  "check.title": "Check",
  "check.what-it-does": "Holds the active version against an image of now: which field lines are where it has them, and how far the others are.",
});
