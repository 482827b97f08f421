"""A second simulator of field cameras, against which accuracy is measured.

It shares nothing with touchline/sources/sim: cameras project by OpenCV, lenses are those of real calibrations and data
sheets, markings lie where somebody painted them, and the picture goes through optics, sensor, demosaicing and JPEG.

    spec = scene_spec(seed)             what the seed stands for; as_json() of it and of the camera is the truth
    scene = render(spec)                picture, true camera, painted field
"""

from tests.support.second_simulator.render import Scene, render
from tests.support.second_simulator.scene_spec import SceneSpec, scene_spec

__all__ = ["Scene", "SceneSpec", "render", "scene_spec"]
