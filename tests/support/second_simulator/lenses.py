"""Lenses of real cameras: published calibrations, and data sheets of lenses for 1/1.8" to 1/3" sensors.

focal: of the picture's width. From a data sheet that tells TV distortion D at a radius r (focal lengths), k1 ≈ D / r².
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class RealLens:
    """focal: of the picture's width. distortion: k1 k2 p1 p2 k3, or the four of cv2.fisheye."""

    name: str
    focal: float
    distortion: tuple[float, ...]
    fisheye: bool = False


REAL_LENSES = (
    # Published calibrations.
    # OpenCV's 20-view sample
    RealLens("opencv-sample-left", 0.837, (-0.2662, -0.0386, 0.0018, -0.0003, 0.2384)),
    # EuRoC MAV, sensor.yaml
    RealLens("euroc-cam0", 0.610, (-0.2834, 0.0740, 0.0002, 0.00002, 0.0)),
    # KITTI 2011_09_26, unrectified
    RealLens("kitti-cam0", 0.707, (-0.3729, 0.2037, 0.0022, 0.0014, -0.0723)),
    # TUM RGB-D, freiburg1
    RealLens("tum-freiburg1", 0.808, (0.2624, -0.9531, -0.0054, 0.0026, 1.1633)),
    RealLens("gopro-hero3", 0.447, (-0.2576, 0.0877, -0.0003, -0.0006, -0.0152)),  # 1080p wide
    # a 1280-px car camera
    RealLens("dash-camera", 0.903, (-0.2410, -0.0531, -0.0012, -0.0001, 0.0267)),
    RealLens("tum-vi-fisheye", 0.373, (0.0035, 0.0007, -0.0021, 0.0002), True),  # TUM VI, 512 px
    # 2.1 mm M12 on 1/2.7"
    RealLens("usb-fisheye-170", 0.330, (-0.0450, 0.0120, -0.0170, 0.0060), True),
    # Data sheets.
    # −4.4 % at the edge, 1/2"
    RealLens("machine-3.5mm", 0.560, (-0.120, 0.018, 0.0003, -0.0002, -0.0015)),
    RealLens("machine-6mm", 0.850, (-0.088, 0.060, -0.0002, 0.0004, 0.0)),  # −1.6 %, 1/1.8"
    RealLens("machine-8mm", 1.130, (-0.062, 0.090, 0.0004, 0.0001, 0.0)),  # −0.7 %, 1/1.8"
    RealLens("machine-12mm", 1.700, (-0.040, 0.120, -0.0003, -0.0003, 0.0)),  # −0.2 %, 1/1.8"
    RealLens("machine-16mm", 2.260, (0.030, 0.0, 0.0002, 0.0003, 0.0)),  # +0.1 %, 1/1.8"
    # autofocus webcam, 78° across the corner
    RealLens("webcam-78", 0.730, (0.050, -0.130, 0.0008, -0.0010, 0.040)),
    RealLens("m12-3.6mm", 0.690, (-0.310, 0.110, 0.0006, -0.0005, -0.0180)),  # board camera, 1/3"
    RealLens("varifocal-4mm", 0.800, (-0.215, 0.105, -0.0005, 0.0004, -0.0250)),  # −5.6 %, 1/2.7"
)
