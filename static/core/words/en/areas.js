// English: the areas of the shipped fields that a camera can cover, as in a sentence, without article.
export default /** @type {const} */ ({
  "areas.eighth-0": "outer bottom left eighth",
  "areas.eighth-1": "outer top left eighth",
  "areas.eighth-2": "inner bottom left eighth",
  "areas.eighth-3": "inner top left eighth",
  "areas.eighth-4": "inner bottom right eighth",
  "areas.eighth-5": "inner top right eighth",
  "areas.eighth-6": "outer bottom right eighth",
  "areas.eighth-7": "outer top right eighth",
  "areas.full": "full field",
  "areas.half": "half, goal line on top",
  "areas.half-left": "left half",
  "areas.half-right": "right half",
  "areas.quarter-bottom-left": "bottom left quarter",
  "areas.quarter-bottom-right": "bottom right quarter",
  "areas.quarter-top-left": "top left quarter",
  "areas.quarter-top-right": "top right quarter",
});
