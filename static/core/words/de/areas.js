// German: the areas of the shipped fields that a camera can cover, nominative without article.
export default /** @type {const} */ ({
  "areas.eighth-0": "äußeres Achtel unten links",
  "areas.eighth-1": "äußeres Achtel oben links",
  "areas.eighth-2": "inneres Achtel unten links",
  "areas.eighth-3": "inneres Achtel oben links",
  "areas.eighth-4": "inneres Achtel unten rechts",
  "areas.eighth-5": "inneres Achtel oben rechts",
  "areas.eighth-6": "äußeres Achtel unten rechts",
  "areas.eighth-7": "äußeres Achtel oben rechts",
  "areas.full": "ganzes Feld",
  "areas.half": "Hälfte, Torlinie oben",
  "areas.half-left": "linke Hälfte",
  "areas.half-right": "rechte Hälfte",
  "areas.quarter-bottom-left": "Viertel unten links",
  "areas.quarter-bottom-right": "Viertel unten rechts",
  "areas.quarter-top-left": "Viertel oben links",
  "areas.quarter-top-right": "Viertel oben rechts",
});
