"""A calibration that the shell has made of a test file's own picture."""

import pytest

from tests.support.paths import CLICKS


@pytest.fixture(scope="module")
def how():
    """More words of the command; a file of tests may have others."""
    return ()


@pytest.fixture(scope="module")
def calibrated():
    """What the shell wrote as a calibration, once for all tests of a file."""
    return []


@pytest.fixture
def calibration(calibrated, how, touchline, picture, tmp_path):
    path, points = tmp_path / "cal.json", CLICKS / "ssl_2008_half.json"
    if not calibrated:
        assert touchline("calibrate", picture, "--points", points, *how, "-o", path)[0] == 0
        calibrated.append(path.read_bytes())
    path.write_bytes(calibrated[0])
    return path
