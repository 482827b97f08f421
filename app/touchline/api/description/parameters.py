"""What the parameters of paths, queries and headers mean, where the parameter itself does not say it."""

KINDS = {  # what an id in a path is the id of, by the word of the path before it
    "calibrations": "calibration version", "cameras": "camera", "clips": "clip", "drafts": "image",
    "heard": "sender, as the list has it", "jobs": "job", "lenses": "lens", "rolls": "roll", "snapshots": "image",
}
NAMES = {"colours": "saved colours", "fields": "field", "rigs": "rig"}  # likewise of a name
PARAMETERS = {
    "before": "id of an older version of the same camera, to show what has changed",
    "camera": "only those of this camera, by its id",
    "cursor": "`next_cursor` of the page before; by default the first page",
    "format": "the format of the file",
    "frame": "the image in whose px the answer is",
    "from": "frame of the points: px of the raw or corrected image, or mm on the field; required with binary points",
    "if-match": "the ETag that was read: the call is refused with 412 if something has changed since",
    "limit": "greatest number of items",
    "number": "number of the frame within the clip, from 0",
    "other": "id of the calibration version that it is compared with",
    "passwords": "with the cameras' passwords, in clear",
    "purpose": "only those that were taken for this purpose",
    "snapshot": "id of a stored image; by default the calibration's own",
    "stage": "name of a stage, to show its result; drawn: the image with all detections",
    "to": "frame of the answer; required with binary points",
    "view": "the view whose correction it is",
    "z_mm": "height of the points above the carpet, mm",
}


def parameter_description(path: str, name: str) -> str | None:
    """Return what a parameter of that path means; None where nothing is known of it."""
    words = path.split("/")
    if f"{{{name}}}" in words:
        of = words[words.index(f"{{{name}}}") - 1]
        if of in NAMES:
            return f"name of the {NAMES[of]}"
        if of in KINDS:
            return f"id of the {KINDS[of]}"
    return PARAMETERS.get(name.lower())
